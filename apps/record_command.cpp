#include <cmath>
#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/jobs/scenes_folder.h"
#include "datasets/sets/run_identity.h"
#include "lab/dvs/dvs_recordings.h"
#include "sensors/events/event_file.h"
#include "sim/sensor/membrane_camera.h"

namespace touchstone::apps {
namespace {

struct DvsOptions {
  std::filesystem::path out;
  int grasps = 0;
  std::uint64_t seed = 1;
};

constexpr int kWindow_ms = 7;

/// Windows of 7 ms from the recording's begin; forces of the window of the force sensor that ended last.
std::string to_csv(const lab::DvsRecording& recording) {
  std::string csv = "end_ms,on,off,true_N,raw_N,measured_N\n";
  auto reading = recording.readings.begin();
  sim::ForceReading last;
  int end_ms = 0;
  for (const sensors::EventCounts& counts : lab::windows_of(recording.by_pixels.front(), 0, kWindow_ms)) {
    end_ms += kWindow_ms;
    for (; reading != recording.readings.end() && reading->seconds * 1e3 <= end_ms; ++reading) last = *reading;
    csv += fmt::format("{},{},{},{:.6g},{:.6g},{:.6g}\n", end_ms, counts.on, counts.off, last.true_N, last.raw_N,
                       last.measured_N);
  }
  return csv;
}

/// The force sensor's readings at the middles of its windows, from the touch on, as `touchstone calibrate event-force`
/// reads them.
std::string force_csv(const lab::DvsRecording& recording) {
  std::string csv = "t_us,force_N\n";
  const auto line = [&](double seconds, double force_N) {
    csv += fmt::format("{},{:.6g}\n", std::llround(1e6 * seconds), force_N);
  };
  if (recording.readings.empty()) return csv;
  line(recording.readings.front().seconds - 1e-3 * kWindow_ms, 0.0);  // before it nothing was touched
  for (const sim::ForceReading& reading : recording.readings) {
    line(reading.seconds - 0.5e-3 * kWindow_ms, reading.measured_N);
  }
  return csv;
}

std::string table_row(const std::string& name, const lab::DvsRecording& recording) {
  const lab::DvsGraspParameters& p = recording.parameters;
  return fmt::format("{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{}\n", name,
                     lab::dvs_materials()[static_cast<std::size_t>(p.material)].name, p.youngs_modulus_MPa,
                     p.motion.target_force_N, p.light_level, recording.touch_s, recording.release_s, recording.apart_s,
                     recording.by_pixels.front().events);
}

void record_dvs(const DvsOptions& options, const GlobalOptions& global) {
  if (std::filesystem::exists(options.out)) {
    fail("--out {}: it is there already; a recording wants a folder of its own", options.out.string());
  }
  require_writable_place(options.out);
  int most = 0;
  for (const lab::DvsMaterial& material : lab::dvs_materials()) most += material.grasps;
  if (options.grasps < 0 || options.grasps > most) {
    fail("--grasps is {}; allowed is 1 to {}, or 0 for all", options.grasps, most);
  }
  const lab::DvsGraspSetup setup(datasets::scenes_folder(), global.cache);
  std::vector<lab::DvsGraspParameters> grasps = setup.draw(options.seed);
  if (options.grasps > 0) {  // spread over the materials
    std::vector<lab::DvsGraspParameters> some;
    for (int k = 0; k < options.grasps; ++k) {
      some.push_back(grasps[grasps.size() * static_cast<std::size_t>(k) / static_cast<std::size_t>(options.grasps)]);
    }
    grasps = some;
  }
  for (lab::DvsGraspParameters& grasp : grasps) grasp.motion.rest_s = lab::kDvsWatched_s;
  const sim::MembraneCamera camera(setup.device());
  const cv::Size size(setup.device().camera->width, setup.device().camera->height);
  std::filesystem::create_directories(options.out);
  std::string table = "grasp,material,youngs_modulus_MPa,target_N,light_level,touch_s,release_s,apart_s,events\n";
  std::string files = "events,forces,material\n";
  auto bar = std::make_unique<ProgressBar>(global.quiet);
  const Progress progress = bar->listener();
  for (std::size_t k = 0; k < grasps.size(); ++k) {
    const std::string name = fmt::format("grasp-{:02}", k);
    write_whole_file(options.out / (name + ".h5"), [&](const std::filesystem::path& temporary) {
      sensors::EventWriter writer(temporary, size, datasets::program_name());
      const lab::DvsRecording recording =
          lab::record_dvs_grasp(setup, camera, grasps[k], lab::own_pixels(setup.device()),
                                [&](std::span<const Event> events) { writer.append(events); });
      writer.close();
      write_whole_file(options.out / (name + ".csv"), to_csv(recording));
      write_whole_file(options.out / (name + "-force.csv"), force_csv(recording));
      files += fmt::format("{0}.h5,{0}-force.csv,{1}\n", name,
                           lab::dvs_materials()[static_cast<std::size_t>(recording.parameters.material)].name);
      table += table_row(name, recording);
    });
    if (progress) progress("grasps", static_cast<std::int64_t>(k) + 1, static_cast<std::int64_t>(grasps.size()));
  }
  write_whole_file(options.out / "grasps.csv", table);
  write_whole_file(options.out / "files.csv", files);
  bar.reset();
  fmt::print("{}: {} grasps\n", options.out.string(), grasps.size());
}

}  // namespace

void add_record_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* records = app.add_subcommand("record", "Record a sensor's experiment");
  records->require_subcommand(1);
  records->fallthrough();
  CLI::App* command =
      records->add_subcommand("dvs", "Grasps of the event-driven fingertip: events, and counts and forces every 7 ms");
  auto options = std::make_shared<DvsOptions>();
  command->add_option("-o,--out", options->out, "The folder to make")->required();
  command->add_option("--grasps", options->grasps, "How many of the 48, spread over the materials (default: all)");
  command->add_option("--seed", options->seed, "Of what differs from grasp to grasp (default 1)");
  command->callback([&action, &global, options] { action = [&global, options] { record_dvs(*options, global); }; });
}

}  // namespace touchstone::apps
