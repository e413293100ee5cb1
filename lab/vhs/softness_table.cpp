#include "lab/vhs/softness_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "core/whole_file.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"
#include "datasets/sources/force_readings_table.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr double kLeastPart = 0.98;  // of a rate: clocks differ
constexpr double kMostSamples = 1e7;

/// Readings a second. @throws Error for a single reading
double rate_of(const sensors::ForceReadings& readings) {
  if (readings.t_us.size() < 2) fail("has one reading; a press over time is needed");
  std::vector<std::int64_t> intervals;
  for (std::size_t i = 1; i < readings.t_us.size(); ++i) {
    std::int64_t interval = 0;
    if (__builtin_sub_overflow(readings.t_us[i], readings.t_us[i - 1], &interval)) fail("has times too far apart");
    intervals.push_back(interval);
  }
  const auto middle = intervals.begin() + std::ssize(intervals) / 2;
  std::nth_element(intervals.begin(), middle, intervals.end());
  return kMicrosecondsPerSecond / static_cast<double>(*middle);
}

/// The same at a rate, straight from reading to reading. @throws Error for readings that are slower
std::vector<double> evenly(const sensors::ForceReadings& readings, double rate_Hz) {
  const double given_Hz = rate_of(readings);
  if (given_Hz < kLeastPart * rate_Hz) fail("has {:.4g} readings a second, {:.4g} are needed", given_Hz, rate_Hz);
  const double length_s =
      (static_cast<double>(readings.t_us.back()) - static_cast<double>(readings.t_us.front())) / kMicrosecondsPerSecond;
  if (length_s * rate_Hz > kMostSamples)
    fail("is {:.4g} s long; {:.4g} s can be read", length_s, kMostSamples / rate_Hz);
  std::vector<double> forces;
  std::size_t next = 1;
  for (double sample = 0.0; sample / rate_Hz <= length_s; ++sample) {
    const double t_us = sample / rate_Hz * kMicrosecondsPerSecond;  // after the first
    // As numbers: clocks may lie so far apart that their difference is no whole one.
    const auto after_first = [&](std::size_t i) {
      return static_cast<double>(readings.t_us[i]) - static_cast<double>(readings.t_us[0]);
    };
    while (next + 1 < readings.t_us.size() && after_first(next) < t_us) ++next;
    const double part = (t_us - after_first(next - 1)) / (after_first(next) - after_first(next - 1));
    forces.push_back(readings.force_N[next - 1] +
                     std::min(part, 1.0) * (readings.force_N[next] - readings.force_N[next - 1]));
  }
  return forces;
}

}  // namespace

KnownSoftnessFiles read_softness_table(const fs::path& csv, double rate_Hz) {
  KnownSoftnessFiles known;
  known.rate_Hz = rate_Hz;
  std::size_t lines = 0;
  datasets::for_each_row(csv, "forces,softness",
                         [&](const SourceLocation& where, const std::vector<std::string>& cells) {
                           const fs::path file = datasets::file_in(csv.parent_path(), cells[0], where);
                           if (cells[1].empty()) fail_at(where, "softness: is empty");
                           ++lines;
                           const std::string fault = datasets::fault_in([&] {
                             datasets::naming(file, [&] {
                               const sensors::ForceReadings readings = datasets::read_force_readings(file);
                               if (known.rate_Hz == 0.0) known.rate_Hz = rate_of(readings);
                               known.presses.push_back({evenly(readings, known.rate_Hz), cells[1]});
                             });
                           });
                           if (!fault.empty()) known.faults.push_back(fault);
                         });
  if (lines == 0) fail("{}: has no press", csv.string());
  if (known.presses.empty()) fail("none of {} presses can be used; the first: {}", lines, known.faults.front());
  return known;
}

std::vector<SoftnessRecord> write_softness(const sensors::SoftnessModel& model, const std::vector<fs::path>& files,
                                           const fs::path& csv, const Progress& progress) {
  std::vector<SoftnessRecord> records;
  std::vector<std::string> faults;
  std::string table = "file,softness,probability,fault\n";
  for (const fs::path& file : files) {
    SoftnessRecord record;
    record.file = file;
    record.fault = datasets::fault_in([&] {
      datasets::naming(file, [&] {
        const sensors::MaterialGuess guess =
            sensors::classify(model, evenly(datasets::read_force_readings(file), model.rate_Hz));
        record.softness = model.networks.front().materials[static_cast<std::size_t>(guess.label)];
        record.probability = guess.probabilities[guess.label];
      });
    });
    const std::string name = datasets::csv_cell(file.filename().string());
    if (record.fault.empty()) {
      table += fmt::format("{},{},{:.4f},\n", name, datasets::csv_cell(record.softness), record.probability);
    } else {
      table += fmt::format("{},,,{}\n", name, datasets::csv_cell(record.fault));
      faults.push_back(record.fault);
    }
    records.push_back(std::move(record));
    if (progress) progress("presses", std::ssize(records), std::ssize(files));
  }
  datasets::require_a_frame(faults, files.size());
  write_whole_file(csv, table);
  return records;
}

}  // namespace touchstone::lab
