// Force from the dvs device's events [Naeini2020, sec. V.C]: tables II and III, sensitivity, latency, and what noise,
// thresholds and the windows' length do to the error. Shapes, folds and steps were chosen on grasps of another seed
// than the rows' (dvs_row_recordings.cpp); nothing was tuned for force but what the paper gives.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "core/error.h"
#include "datasets/sets/processor.h"
#include "lab/dvs/dvs_force_experiment.h"
#include "lab/dvs/dvs_row_recordings.h"
#include "lab/validation/row_list.h"

namespace touchstone::lab {
namespace {

constexpr double kPublishedNetwork_mse = 0.16, kPublishedProcess_mse = 0.17, kPublishedValidation_mse = 0.15;
constexpr double kPublishedNetworkStep_N = 0.01, kPublishedProcessStep_N = 0.02;
constexpr double kPublishedLatency_ms = 21.0;
constexpr double kAllowedWindow_us = 100.0;  // issue 7 of this project
constexpr double kAllowedChange = 0.25;      // of the error, by noise, thresholds or windows
constexpr int kSparse = 8;                   // folds of studies: each such one
constexpr int kTableFolds = 8;               // of tables
// With early stopping networks of the seed they were chosen on ended after 10 to 20 steps: at most 25 cost 2 x 15 2 %
// of its error against no bound, and 4 x 40 was 2 % better than with 10.
constexpr int kTableSteps = 25;

constexpr std::array<int, 8> kUnits = {5, 10, 15, 20, 25, 30, 35, 40};
using TextTable = std::array<std::array<double, 8>, 5>;
constexpr TextTable kTable2 = {{{0.23, 0.19, 0.18, 0.19, 0.20, 0.18, 0.16, 0.16},
                                {0.21, 0.19, 0.16, 0.17, 0.17, 0.17, 0.17, 0.17},
                                {0.19, 0.20, 0.18, 0.18, 0.16, 0.17, 0.17, 0.17},
                                {0.20, 0.19, 0.16, 0.17, 0.18, 0.17, 0.17, 0.15},
                                {0.20, 0.16, 0.20, 0.18, 0.18, 0.16, 0.17, 0.16}}};
constexpr TextTable kTable3 = {{{0.16, 0.24, 0.15, 0.22, 0.19, 0.16, 0.24, 0.15},
                                {0.17, 0.16, 0.16, 0.16, 0.17, 0.18, 0.15, 0.35},
                                {0.18, 0.18, 0.16, 0.17, 0.16, 0.16, 0.16, 0.16},
                                {0.18, 0.17, 0.16, 0.16, 0.16, 0.17, 0.19, 0.16},
                                {0.18, 0.16, 0.24, 0.17, 0.20, 0.15, 0.24, 0.18}}};

/// A figure's mean over folds with its 95 % interval, against the paper's or another.
void add_error(RowList& rows, const std::string& id, const std::string& title, double bound, bool published,
               const DvsForceScore& score, double DvsForceFold::*figure) {
  const double ours = score.mean(figure);
  const double half = kNormal95 * score.standard_error(figure);
  ValidationRow& row = rows.add(id, title, "N^2", ours, Better::lower, ours <= bound);
  (published ? row.published : row.reference) = bound;
  if (score.folds.size() > 1) row.ci95 = {ours - half, ours + half};
}

void add_tables(std::span<const DvsSequence> sequences, const ValidateOptions& options, RowList& rows) {
  DvsForceSettings settings;
  settings.every = kTableFolds;
  struct Table {
    const char* id;
    const char* what;
    const TextTable& text;
    double DvsForceFold::*figure;
  };
  const std::array<Table, 2> tables = {{{"tdnn.table2", "validation", kTable2, &DvsForceFold::validation_mse},
                                        {"tdnn.table3", "test", kTable3, &DvsForceFold::test_mse}}};
  for (int layers = 1; layers <= 5; ++layers) {
    std::array<DvsForceScore, kUnits.size()> scores;
    for (std::size_t n = 0; n < kUnits.size(); ++n) {
      sensors::TimeDelayNetworkSettings network;
      network.hidden_layers = layers;
      network.units = kUnits[n];
      network.training.most_steps = kTableSteps;
      scores[n] = test_force_networks(sequences, network, settings, options.progress);
    }
    for (const Table& table : tables) {
      const auto& text = table.text[static_cast<std::size_t>(layers - 1)];
      std::string cells;
      ValidationSeries series{"units of a layer", "mean squared error [N^2]", {}};
      double ours = 0.0, published = 0.0;
      for (std::size_t n = 0; n < kUnits.size(); ++n) {
        const double mse = scores[n].mean(table.figure);
        cells += fmt::format("{} n={}: {:.3f} ({:.2f})", n == 0 ? "" : ",", kUnits[n], mse, text[n]);
        series.points.emplace_back(kUnits[n], mse);
        ours += mse / kUnits.size();
        published += text[n] / kUnits.size();
      }
      ValidationRow& row = rows.add(
          fmt::format("{}.k{}", table.id, layers),
          fmt::format("{} error of networks of {} hidden layers, mean of{} (the paper's in brackets); each {}th "
                      "fold, at most {} steps of training",
                      table.what, layers, cells, kTableFolds, kTableSteps),
          "N^2", ours, Better::lower, ours <= published);
      row.published = published;
      row.series = series;
    }
  }
}

/// Gaussian processes where noise, thresholds or the windows' length are others.
void add_studies(const std::vector<DvsRecording>& recordings, const ValidateOptions& options, RowList& rows) {
  DvsForceSettings settings;
  settings.every = kSparse;
  const auto error_with = [&](const DvsSequenceSettings& how, std::size_t& seen, double& hardest) {
    const DvsSequences sequences = dvs_sequences(recordings, how);
    seen = sequences.seen.size();
    hardest = sequences.unseen_peak_N;
    if (static_cast<int>(seen) < settings.validation + 2) return std::numeric_limits<double>::quiet_NaN();
    return test_force_processes(sequences.seen, {}, settings, options.progress).mean(&DvsForceFold::test_mse);
  };
  std::size_t seen = 0;
  double hardest = 0.0;
  const double usual = error_with({}, seen, hardest);
  const auto add = [&](const std::string& id, const std::string& what, const DvsSequenceSettings& how) {
    const double ours = error_with(how, seen, hardest);
    rows.add(id,
             fmt::format("test error of Gaussian processes, {}, each {}th fold; {} of {} grasps are seen, the hardest "
                         "that isn't presses by {:.2f} N",
                         what, kSparse, seen, recordings.size(), hardest),
             "N^2", ours, Better::near, std::abs(ours - usual) <= kAllowedChange * usual)
        .reference = usual;
  };
  for (std::size_t kind = 1; kind < kDvsPixelKinds.size(); ++kind) {
    add(fmt::format("gp.{}_mse", kDvsPixelKinds[kind].id), fmt::format("event pixels {}", kDvsPixelKinds[kind].title),
        {.pixels = static_cast<int>(kind)});
  }
  for (const int window_ms : {3, 14, 28}) {
    add(fmt::format("gp.window_{}ms_mse", window_ms), fmt::format("windows of {} ms", window_ms),
        {.window_ms = window_ms});
  }
  add("gp.skip_hold_mse", "counts without those of the hold", {.accumulation = sensors::Accumulation::kSkipHold});
}

}  // namespace

std::vector<ValidationRow> validate_dvs_force(const ValidateOptions& options) {
  datasets::use_one_blas_thread();
  RowList rows("dvs.", options, RowList::Since::last_row);
  const DvsRecordings recordings = dvs_row_recordings(options);
  const DvsSequences sequences = dvs_sequences(*recordings);
  const auto all = static_cast<double>(recordings->size());
  rows.add_bounded(
      "touch.seen_percent",
      fmt::format("of {} grasps, those whose touch and release are detected; the hardest that isn't presses by "
                  "{:.2f} N",
                  recordings->size(), sequences.unseen_peak_N),
      "%", Better::higher, 90.0, false, 100.0 * static_cast<double>(sequences.seen.size()) / all);
  double touch = 0.0, release = 0.0, latest_touch = 0.0, latest_release = 0.0;
  for (const DvsSequence& one : sequences.seen) {
    touch += one.touch_delay_ms / static_cast<double>(sequences.seen.size());
    release += one.release_delay_ms / static_cast<double>(sequences.seen.size());
    latest_touch = std::max(latest_touch, one.touch_delay_ms);
    latest_release = std::max(latest_release, one.release_delay_ms);
  }
  rows.add_bounded(
      "touch.delay_ms",
      fmt::format("from the true first touch to the end of the window that shows it, mean; the latest {:.1f}",
                  latest_touch),
      "ms", Better::lower, kPublishedLatency_ms, false, touch);
  rows.add_bounded(
      "release.delay_ms",
      fmt::format("from the servo's order to open to the end of the window that shows it, mean; the latest "
                  "{:.1f}",
                  latest_release),
      "ms", Better::lower, kPublishedLatency_ms, false, release);

  DvsForceSettings settings;
  sensors::TimeDelayNetworkSettings network;
  if (options.quick) {
    settings.every = kSparse;
    settings.validation = 3;
    network.hidden_layers = 1;
    network.units = 10;
  }
  const std::string shape = fmt::format("{} hidden layers of {}", network.hidden_layers, network.units);
  const DvsForceScore net = test_force_networks(sequences.seen, network, settings, options.progress);
  add_error(rows, "tdnn.test_mse", "test error of the network, " + shape + ", against the reference sensor",
            kPublishedNetwork_mse, true, net, &DvsForceFold::test_mse);
  add_error(rows, "tdnn.validation_mse", "validation error of it", kPublishedValidation_mse, true, net,
            &DvsForceFold::validation_mse);
  const DvsForceScore process = test_force_processes(sequences.seen, {}, settings, options.progress);
  add_error(rows, "gp.test_mse", "test error of Gaussian processes, against the reference sensor",
            kPublishedProcess_mse, true, process, &DvsForceFold::test_mse);
  const DvsForceScore clock = test_force_processes(sequences.seen, {}, settings, options.progress, DvsInputs::time);
  const double by_time = clock.mean(&DvsForceFold::test_mse);
  ValidationRow& control = rows.add("gp.time_alone_mse",
                                    "a control: Gaussian processes that are given the time since the touch and nothing "
                                    "of the events; held against those that see them, and should be worse",
                                    "N^2", by_time, Better::higher, by_time > process.mean(&DvsForceFold::test_mse));
  control.reference = process.mean(&DvsForceFold::test_mse);
  // What was learned from a sensor that lags is held against the truth, beside that sensor's own error.
  const double sensor = net.mean(&DvsForceFold::sensor_mse);
  add_error(rows, "tdnn.true_mse", "the same network, against the true force; bound: the reference sensor's own error",
            sensor, false, net, &DvsForceFold::true_mse);
  add_error(rows, "gp.true_mse", "the same processes, against the true force; bound: likewise", sensor, false, process,
            &DvsForceFold::true_mse);
  DvsForceSettings on_truth = settings;
  on_truth.learned = DvsForce::truth;
  on_truth.every = kSparse;
  const DvsForceScore true_net = test_force_networks(sequences.seen, network, on_truth, options.progress);
  add_error(rows, "tdnn.learned_true_mse",
            fmt::format("networks trained and tested on the true force, each {}th fold", kSparse),
            kPublishedNetwork_mse, true, true_net, &DvsForceFold::test_mse);
  const DvsForceScore true_process = test_force_processes(sequences.seen, {}, on_truth, options.progress);
  add_error(rows, "gp.learned_true_mse",
            fmt::format("Gaussian processes trained and tested on the true force, each {}th fold", kSparse),
            kPublishedProcess_mse, true, true_process, &DvsForceFold::test_mse);
  rows.add_bounded("tdnn.sensitivity_N", "least step of the network's estimate above 0.2 N, mean over folds", "N",
                   Better::lower, kPublishedNetworkStep_N, true, net.sensitivity_N());
  rows.add_bounded("gp.sensitivity_N", "least step of the processes' estimate above 0.2 N, mean over folds", "N",
                   Better::lower, kPublishedProcessStep_N, true, process.sensitivity_N());
  const double window_us = net.mean(&DvsForceFold::window_us);
  rows.add_bounded("tdnn.window_us", "one window's force by the network, one thread", "us", Better::lower,
                   kAllowedWindow_us, false, window_us);
  rows.add_bounded("gp.window_us", "one window's force by a Gaussian process, one thread", "us", Better::lower,
                   kAllowedWindow_us, false, process.mean(&DvsForceFold::window_us));
  const double latency_ms = 3 * 7.0 + 1e-3 * window_us;
  constexpr double kSameLatency_ms = 0.5;
  rows.add("latency_ms", "three windows of 7 ms, and the estimate", "ms", latency_ms, Better::near,
           std::abs(latency_ms - kPublishedLatency_ms) < kSameLatency_ms)
      .published = kPublishedLatency_ms;
  if (!options.quick) {
    add_studies(*recordings, options, rows);
    add_tables(sequences.seen, options, rows);
  }
  return rows.rows();
}

}  // namespace touchstone::lab
