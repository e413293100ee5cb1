#include "lab/dvs/grasp_files.h"

#include "core/error.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"
#include "datasets/sources/force_readings_table.h"
#include "sensors/events/event_file.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr const char* kGraspColumns = "events,forces,material";

/// All windows of a file. @throws Error
std::vector<sensors::EventCounts> windows_of_file(const fs::path& file, const sensors::EventReadOptions& options,
                                                  const sensors::EventWindowSettings& settings) {
  sensors::EventReader reader(file, options);
  sensors::EventWindows windows(settings);
  for (auto events = reader.next(); !events.empty(); events = reader.next()) windows.add(events);
  return {windows.finished().begin(), windows.finished().end()};
}

sensors::KnownGrasp seen_grasp(const GraspFiles& files, const sensors::EventReadOptions& options) {
  const sensors::EventWindowSettings settings = windows_for(files.events, options);
  const std::vector<sensors::EventCounts> windows = windows_of_file(files.events, options, settings);
  sensors::ForceReadings readings;
  if (!files.forces.empty()) readings = datasets::read_force_readings(files.forces);
  sensors::KnownGrasp grasp =
      sensors::known_grasp(windows, settings, files.forces.empty() ? nullptr : &readings, files.forces.string());
  grasp.material = files.material;
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

}  // namespace touchstone::lab
