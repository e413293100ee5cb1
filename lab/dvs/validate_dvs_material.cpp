// Material from one grasp's events [Naeini2020, sec. V.D]: tables IV and V, the confusion matrix, and the same
// classifier fed with the reference sensor's force.

#include <array>
#include <cmath>
#include <string>

#include "core/error.h"
#include "lab/dvs/dvs_row_recordings.h"
#include "lab/dvs/dvs_sequences.h"
#include "lab/validation/row_list.h"
#include "sensors/events/material_trial.h"

namespace touchstone::lab {
namespace {

constexpr double kPublished = 79.17, kPublishedSoft = 73.3, kPublishedForceSensor = 50.0;
constexpr double kPublishedSteel = 100.0 * 13 / 14;  // "only one error over all folds"
constexpr double kAllowedDifference = 10.0;          // of the force sensor's, per cent
constexpr std::array<int, 6> kUnits = {5, 10, 15, 20, 25, 30};
using TextTable = std::array<std::array<double, 6>, 6>;
constexpr TextTable kTable4 = {{{80.21, 76.56, 83.33, 84.38, 85.94, 83.85},
                                {70.31, 81.25, 84.38, 85.94, 86.98, 90.10},
                                {64.06, 77.60, 81.77, 85.42, 86.98, 88.54},
                                {67.19, 77.60, 78.65, 84.38, 84.90, 89.06},
                                {60.42, 68.75, 76.56, 81.25, 86.46, 90.10},
                                {60.94, 69.79, 74.48, 81.77, 85.42, 86.46}}};
constexpr TextTable kTable5 = {{{70.83, 68.75, 62.50, 70.83, 62.50, 68.75},
                                {58.33, 62.50, 68.75, 75.00, 60.42, 79.17},
                                {50.00, 58.33, 56.25, 72.92, 72.92, 77.08},
                                {60.42, 58.33, 72.92, 68.75, 60.42, 75.00},
                                {50.00, 45.83, 54.17, 62.50, 68.75, 72.92},
                                {39.58, 58.33, 66.67, 58.33, 70.83, 75.00}}};
constexpr std::array<int, 3> kSoft = {0, 1, 2};
constexpr std::array<int, 1> kSteel = {3};

/// What the classification of materials depends on: how alike the grasps are. "A similar range of applied force" (sec.
/// IV, fig. 5).
struct Alike {
  const char* id;
  const char* title;
  DvsSpread spread;
};
constexpr std::array<Alike, 3> kAlike = {
    {{"many_setups_percent", "each on a setup of its own", {.setup = 1.0}},
     {"one_force_percent", "grasps that all want 1.7 to 2.1 N, in place of 0.3 to 3.5 N", {.force = 0.125}},
     {"all_alike_percent", "of one force, and poses of a tenth of the spread", {.force = 0.125, .pose = 0.1}}}};

std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const DvsMaterial& material : dvs_materials()) all.push_back(material.name);
  return all;
}

/// "foam 6 3 1 1; rubber ..."
std::string matrix_text(const sensors::ConfusionMatrix& matrix) {
  std::string text;
  for (Eigen::Index row = 0; row < matrix.counts.rows(); ++row) {
    text += (row == 0 ? "" : "; ") + names()[static_cast<std::size_t>(row)];
    for (Eigen::Index column = 0; column < matrix.counts.cols(); ++column) {
      text += fmt::format(" {}", matrix.counts(row, column));
    }
  }
  return text;
}

/// A share of right ones in per cent, with the interval that so few grasps leave.
ValidationRow& add_share(RowList& rows, const std::string& id, const std::string& title, double published, double share,
                         int grasps) {
  const double half = kNormal95 * std::sqrt(share * (1.0 - share) / grasps);
  ValidationRow& row = rows.add(id, title, "%", 100.0 * share, Better::higher, 100.0 * share >= published);
  row.published = published;
  row.ci95 = {100.0 * std::max(0.0, share - half), 100.0 * std::min(1.0, share + half)};
  return row;
}

void add_tables(std::span<const sensors::MaterialSample> samples, const ValidateOptions& options, RowList& rows) {
  struct Table {
    const char* id;
    const char* what;
    const TextTable& text;
    sensors::ConfusionMatrix sensors::MaterialTrialScore::*matrix;
  };
  const std::array<Table, 2> tables = {
      {{"table4", "validation grasps", kTable4, &sensors::MaterialTrialScore::validation},
       {"table5", "test grasps", kTable5, &sensors::MaterialTrialScore::test}}};
  for (int layers = 1; layers <= static_cast<int>(kTable4.size()); ++layers) {
    std::array<sensors::MaterialTrialScore, kUnits.size()> scores;
    for (std::size_t n = 0; n < kUnits.size(); ++n) {
      sensors::MaterialTrialSettings settings;
      settings.classifier.hidden_layers = layers;
      settings.classifier.units = kUnits[n];
      scores[n] = sensors::test_material_classifiers(samples, names(), settings, options.progress);
    }
    for (const Table& table : tables) {
      const auto& text = table.text[static_cast<std::size_t>(layers - 1)];
      std::string cells;
      ValidationSeries series{"units of a layer", "right [%]", {}};
      double ours = 0.0, published = 0.0;
      for (std::size_t n = 0; n < kUnits.size(); ++n) {
        const double right = 100.0 * (scores[n].*table.matrix).accuracy();
        cells += fmt::format("{} n={}: {:.1f} ({:.1f})", n == 0 ? "" : ",", kUnits[n], right, text[n]);
        series.points.emplace_back(kUnits[n], right);
        ours += right / kUnits.size();
        published += text[n] / kUnits.size();
      }
      ValidationRow& row =
          rows.add(fmt::format("{}.k{}", table.id, layers),
                   fmt::format("{} classified correctly by {} hidden layers, mean of{} (paper's in brackets)",
                               table.what, layers, cells),
                   "%", ours, Better::higher, ours >= published);
      row.published = published;
      row.series = series;
    }
  }
}

}  // namespace

std::vector<ValidationRow> validate_dvs_material(const ValidateOptions& options) {
  RowList rows("dvs.material.", options, RowList::Since::last_row);
  const DvsSequences sequences = dvs_sequences(*dvs_row_recordings(options));
  const std::vector<sensors::MaterialSample> samples = event_samples(sequences.seen);
  const auto grasps = static_cast<int>(samples.size());
  const sensors::MaterialTrialSettings settings;
  const sensors::MaterialTrialScore score =
      sensors::test_material_classifiers(samples, names(), settings, options.progress);
  const double right = score.test.accuracy();
  add_share(
      rows, "accuracy_percent",
      fmt::format(
          "materials classified correctly in unseen grasps by 2 hidden layers of 30, of {} whose touch was detected; "
          "what each was classified as: {}",
          grasps, matrix_text(score.test)),
      kPublished, right, grasps);
  add_share(rows, "soft_accuracy_percent", "of foam, rubber and silicone", kPublishedSoft, score.test.accuracy(kSoft),
            score.test.counts.topRows(kSoft.size()).sum());
  add_share(rows, "steel_percent", "of steel", kPublishedSteel, score.test.accuracy(kSteel),
            score.test.counts.bottomRows(1).sum());
  const sensors::MaterialTrialScore by_force =
      sensors::test_material_classifiers(force_sensor_samples(sequences.seen), names(), settings, options.progress);
  const double force_right = by_force.test.accuracy();
  ValidationRow& force =
      add_share(rows, "force_sensor_percent",
                "the same classifier fed with the reference sensor's force: " + matrix_text(by_force.test),
                kPublishedForceSensor, force_right, grasps);
  force.better = Better::near;
  force.holds = std::abs(force.ours - kPublishedForceSensor) <= kAllowedDifference;
  rows.add_bounded("over_force_sensor_percent",
                   "by how much events classify more materials correctly than the force sensor", "%", Better::higher,
                   kPublished - kPublishedForceSensor, true, 100.0 * (right - force_right));
  if (!options.quick) {
    add_tables(samples, options, rows);
    for (const Alike& alike : kAlike) {
      const std::vector<sensors::MaterialSample> grasped =
          event_samples(dvs_sequences(*dvs_alike_recordings(options, alike.id, alike.spread)).seen);
      const sensors::MaterialTrialScore classified =
          sensors::test_material_classifiers(grasped, names(), settings, options.progress);
      add_share(rows, alike.id, fmt::format("{}: {}", alike.title, matrix_text(classified.test)), kPublished,
                classified.test.accuracy(), static_cast<int>(grasped.size()));
    }
  }
  return rows.rows();
}

}  // namespace touchstone::lab
