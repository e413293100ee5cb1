#include "lab/dvs/grasp_estimates.h"

#include <algorithm>
#include <map>

#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"
#include "lab/dvs/grasp_files.h"
#include "sensors/events/event_file.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

void require_own_stems(const std::vector<fs::path>& files) {
  std::map<fs::path, fs::path> seen;
  for (const fs::path& file : files) {
    const auto [first, is_new] = seen.emplace(file.stem(), file);
    if (!is_new) {
      fail("{} and {} would be written into one file; give them other names", first->second.string(), file.string());
    }
  }
}

std::string csv_of(std::span<const sensors::WindowForce> windows) {
  std::string csv = "t_us,on,off,touched,force_N,sigma_force_N,extrapolated\n";
  for (const sensors::WindowForce& window : windows) {
    csv += fmt::format("{},{},{},{},{:.6g},{},{}\n", window.end_us, window.counts.on, window.counts.off,
                       window.touched ? 1 : 0, window.force_N,
                       window.sigma_N ? fmt::format("{:.6g}", *window.sigma_N) : "", window.extrapolates ? 1 : 0);
  }
  return csv;
}

}  // namespace

std::vector<GraspForceRecord> write_grasp_forces(const sensors::GraspForceModel& model,
                                                 const std::vector<fs::path>& files,
                                                 const sensors::EventReadOptions& options, const fs::path& folder,
                                                 const Progress& progress) {
  require_own_stems(files);
  const sensors::GraspForceReader of_model(model, {});  // a model that can't be used is no fault of a file
  std::vector<GraspForceRecord> records;
  std::vector<std::string> faults;
  for (const fs::path& file : files) {
    GraspForceRecord record;
    record.file = file;
    std::optional<sensors::GraspForceReader> reader;
    sensors::MainsFlickerMeter flicker;
    record.fault = datasets::fault_in([&] {
      datasets::naming(file, [&] {
        reader.emplace(model, windows_for(file, options));
        sensors::EventReader source(file, options);
        for (auto events = source.next(); !events.empty(); events = source.next()) {
          reader->add(events);
          if (reader->forces().empty() || !reader->forces().back().touched) flicker.add(events);
        }
      });
    });
    record.flicker = flicker.flicker();
    if (reader && !reader->forces().empty()) {
      for (const sensors::WindowForce& window : reader->forces()) {
        ++record.windows;
        record.touched += window.touched ? 1 : 0;
        record.extrapolated += window.extrapolates ? 1 : 0;
        record.largest_N = std::max(record.largest_N, window.force_N);
      }
      fs::create_directories(folder);
      write_whole_file(folder / file.stem().concat(".csv"), csv_of(reader->forces()));
    } else {
      if (record.fault.empty()) record.fault = fmt::format("{}: is shorter than a window", file.string());
      faults.push_back(record.fault);
    }
    records.push_back(std::move(record));
    if (progress) progress("grasps", std::ssize(records), std::ssize(files));
  }
  datasets::require_a_frame(faults, files.size());
  return records;
}

std::vector<GraspMaterialRecord> write_grasp_materials(const sensors::MaterialClassifier& model,
                                                       const std::vector<fs::path>& files,
                                                       const sensors::EventReadOptions& options, const fs::path& csv,
                                                       const Progress& progress) {
  std::vector<GraspMaterialRecord> records;
  std::vector<std::string> faults;
  std::string table = "file,material,probability,fault\n";
  for (const fs::path& file : files) {
    GraspMaterialRecord record;
    record.file = file;
    record.fault = datasets::fault_in([&] {
      const SeenGrasps grasp = read_grasps({{file, {}, {}}}, options);
      const sensors::GraspSequence& sequence = grasp.seen.front().sequence;
      datasets::naming(file, [&] {
        const sensors::MaterialGuess guess =
            sensors::classify(model, sensors::grasp_features(sequence.counts, sequence.judged));
        record.material = model.materials[static_cast<std::size_t>(guess.label)];
        record.probability = guess.probabilities[guess.label];
      });
    });
    const std::string name = datasets::csv_cell(file.filename().string());
    if (record.fault.empty()) {
      table += fmt::format("{},{},{:.4f},\n", name, datasets::csv_cell(record.material), record.probability);
    } else {
      table += fmt::format("{},,,{}\n", name, datasets::csv_cell(record.fault));
      faults.push_back(record.fault);
    }
    records.push_back(std::move(record));
    if (progress) progress("grasps", std::ssize(records), std::ssize(files));
  }
  datasets::require_a_frame(faults, files.size());
  write_whole_file(csv, table);
  return records;
}

}  // namespace touchstone::lab
