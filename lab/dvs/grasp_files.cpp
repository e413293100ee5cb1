#include "lab/dvs/grasp_files.h"

#include <algorithm>

#include "core/error.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"
#include "sensors/events/event_file.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr const char* kGraspColumns = "events,forces,material";
constexpr const char* kForceColumns = "t_us,force_N";

/// All windows of a file. @throws Error
std::vector<sensors::EventCounts> windows_of_file(const fs::path& file, const sensors::EventReadOptions& options,
                                                  const sensors::EventWindowSettings& settings) {
  sensors::EventReader reader(file, options);
  sensors::EventWindows windows(settings);
  for (auto events = reader.next(); !events.empty(); events = reader.next()) windows.add(events);
  return {windows.finished().begin(), windows.finished().end()};
}

SeenGrasp seen_grasp(const GraspFiles& files, const sensors::EventReadOptions& options) {
  const sensors::EventWindowSettings settings = windows_for(files.events, options);
  SeenGrasp grasp;
  grasp.files = files;
  const std::vector<sensors::EventCounts> windows = windows_of_file(files.events, options, settings);
  const sensors::GraspPhases phases = sensors::find_grasp_phases(windows);
  grasp.sequence = sensors::grasp_sequence(windows, phases, settings.length_us);
  if (files.forces.empty()) return grasp;
  const sensors::ForceReadings readings = read_force_readings(files.forces);
  const auto begin_us = [&](std::int64_t window) { return settings.start_us + window * settings.length_us; };
  if (readings.t_us.back() < begin_us(phases.release_end - 1)) {
    fail("{}: ends at {} us; the release ends at {} us", files.forces.string(), readings.t_us.back(),
         begin_us(phases.release_end));
  }
  grasp.force_N.resize(phases.release_end - phases.first_touch);
  for (int window = phases.first_touch; window < phases.release_end; ++window) {
    grasp.force_N[window - phases.first_touch] =
        sensors::mean_force_N(readings, begin_us(window), begin_us(window + 1));
  }
  return grasp;
}

}  // namespace

std::vector<GraspFiles> read_grasp_table(const fs::path& csv, GraspNeeds needs) {
  std::vector<GraspFiles> table;
  const fs::path folder = csv.parent_path();
  datasets::for_each_row(csv, kGraspColumns, [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    GraspFiles one;
    one.events = datasets::file_in(folder, cells[0], where);
    if (!cells[1].empty()) {
      one.forces = folder / cells[1];
      if (const std::string fault = fault_of_file(one.forces); !fault.empty()) fail_at(where, "forces: {}", fault);
    } else if (needs == GraspNeeds::forces) {
      fail_at(where, "forces: is empty");
    }
    one.material = cells[2];
    if (one.material.empty() && needs == GraspNeeds::materials) fail_at(where, "material: is empty");
    table.push_back(std::move(one));
  });
  if (table.empty()) fail("{}: has no grasp", csv.string());
  return table;
}

sensors::ForceReadings read_force_readings(const fs::path& csv) {
  sensors::ForceReadings readings;
  datasets::for_each_row(csv, kForceColumns, [&](const SourceLocation& where, const std::vector<std::string>& cells) {
    const auto t_us = datasets::whole_number_in<std::int64_t>(cells[0], "t_us", where);
    if (!readings.t_us.empty() && t_us <= readings.t_us.back()) {
      fail_at(where, "t_us: {} isn't after the line before's, {}", t_us, readings.t_us.back());
    }
    readings.t_us.push_back(t_us);
    readings.force_N.push_back(datasets::number_in(cells[1], "force_N", where));
  });
  if (const std::string fault = fault_of(readings); !fault.empty()) fail("{}: {}", csv.string(), fault);
  return readings;
}

sensors::EventWindowSettings windows_for(const fs::path& events, const sensors::EventReadOptions& options) {
  sensors::EventReader reader(events, options);
  const std::span<const Event> first = reader.next();
  if (first.empty()) fail("{}: has no event", events.string());
  if (!reader.source().size) fail("{}: doesn't say how large its camera's picture is: --size does", events.string());
  return {.start_us = first.front().t_us, .size = *reader.source().size};
}

SeenGrasps read_grasps(const std::vector<GraspFiles>& table, const sensors::EventReadOptions& options,
                       const Progress& progress) {
  SeenGrasps grasps;
  std::int64_t done = 0;
  for (const GraspFiles& files : table) {
    std::string fault = datasets::fault_in(
        [&] { datasets::naming(files.events, [&] { grasps.seen.push_back(seen_grasp(files, options)); }); });
    if (!fault.empty()) grasps.faults.push_back(std::move(fault));
    if (progress) progress("grasps", ++done, std::ssize(table));
  }
  if (grasps.seen.empty()) fail("none of {} grasps can be used; the first: {}", table.size(), grasps.faults.front());
  return grasps;
}

std::vector<sensors::ForceSeries> force_series_of(const std::vector<SeenGrasp>& grasps, bool with_time) {
  std::vector<sensors::ForceSeries> all;
  for (const SeenGrasp& grasp : grasps) {
    sensors::ForceSeries& series = all.emplace_back();
    series.features = grasp.sequence.counts;
    if (with_time) {
      series.features.conservativeResize(Eigen::NoChange, 3);
      series.features.col(2) = grasp.sequence.time_s;
    }
    series.force_N = grasp.force_N;
    series.judged = grasp.sequence.judged;
  }
  return all;
}

std::vector<sensors::MaterialSample> material_samples_of(const std::vector<SeenGrasp>& grasps,
                                                         std::vector<std::string>& materials) {
  std::vector<sensors::MaterialSample> samples;
  for (const SeenGrasp& grasp : grasps) {
    auto known = std::ranges::find(materials, grasp.files.material);
    if (known == materials.end()) known = materials.insert(known, grasp.files.material);
    samples.push_back({sensors::grasp_features(grasp.sequence.counts, grasp.sequence.judged),
                       static_cast<int>(known - materials.begin())});
  }
  return samples;
}

}  // namespace touchstone::lab
