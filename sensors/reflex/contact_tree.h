#pragma once
// Does anything press? A decision tree on the statistics of a motion-sensing chip's frame [Knoop2013, sec. III.D, eq.
// 2].

#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/motion_chip.h"

namespace touchstone::sensors {

/// The statistics that normal force shows in; DX and DY belong to shear [Knoop2013].
enum class ChipFeature { maximum, minimum, squal, average };
/// All of them, in the order of their numbers.
inline constexpr std::array<ChipFeature, 4> kChipFeatures = {ChipFeature::maximum, ChipFeature::minimum,
                                                             ChipFeature::squal, ChipFeature::average};
/// As the paper calls it: MAX, MIN, SQ, AVG.
std::string name_of(ChipFeature feature);

/// The statistic itself, in the chip's units.
inline double value_of(const ChipStatistics& statistics, ChipFeature feature) {
  switch (feature) {
    case ChipFeature::maximum:
      return statistics.maximum;
    case ChipFeature::minimum:
      return statistics.minimum;
    case ChipFeature::squal:
      return statistics.squal;
    case ChipFeature::average:
      return statistics.average;
  }
  return 0.0;
}

/// A question, or where `above` is 0 an answer.
struct ContactTreeNode {
  ChipFeature feature = ChipFeature::maximum;
  double threshold = 0.0;      ///< is the feature above it?
  int above = 0, below = 0;    ///< the nodes to go to: above it, and at or below it; both come after this one
  bool force_present = false;  ///< the answer
};

/// The first node is the root. Registers are whole numbers, so their thresholds are too; AVG's needn't be.
struct ContactTree {
  std::vector<ContactTreeNode> nodes;
};

/// What is wrong with it; empty if nothing is. What follows needs a tree without fault.
std::string fault_of(const ContactTree& tree);

/// No allocation, at most as many comparisons as the tree is deep.
inline bool force_present(const ContactTree& tree, const ChipStatistics& statistics) {
  const ContactTreeNode* node = tree.nodes.data();
  while (node->above != 0) {
    const bool above = value_of(statistics, node->feature) > node->threshold;
    node = &tree.nodes[static_cast<std::size_t>(above ? node->above : node->below)];
  }
  return node->force_present;
}

/// When the tree says that a force is present, as in the paper's eq. 2: "MAX > 40 or (MAX > 38 and SQ < 82)". Each part
/// is a path through the tree, without the conditions that change nothing since others of the parts cover what they
/// forbid. "always" or "never" where nothing is asked.
std::string rule_of(const ContactTree& tree);

/// One frame, and whether there was a force.
struct ContactSample {
  ChipStatistics statistics;
  bool force_present = false;
};

/// Questions on the longest path that a tree may have: rule_of goes along every path.
inline constexpr int kDeepestContactTree = 14;

/// How large a tree may grow, and how it is pruned.
struct ContactTreeSettings {
  int folds = 10;                  ///< of the cross-validation that prunes; 1: no pruning
  bool one_standard_error = true;  ///< the smallest tree within one standard error of the best [Breiman1984]
  int most_depth = 8;              ///< 1 to kDeepestContactTree
  int least_samples = 10;          ///< a node with fewer isn't split
  double missed_weight = 1.0;      ///< how much a missed force weighs, beside a force where there is none
};

/// A tree grown by OpenCV's CART and pruned by cost and complexity [Breiman1984], which OpenCV 4 doesn't do: a leaf's
/// price is found by cross-validation over folds that take turns. The same tree for the same samples.
/// @throws Error for settings that make no sense, statistics out of range, or samples of one kind only
ContactTree train_contact_tree(std::span<const ContactSample> samples, const ContactTreeSettings& settings = {});

/// How often a tree is wrong, as the paper counts it.
struct ContactScore {
  int samples = 0;
  int missed = 0;  ///< a force is present, the tree says none
  int false_alarms = 0;
  double error_percent() const { return samples > 0 ? 100.0 * (missed + false_alarms) / samples : 0.0; }
};
/// How often the tree's answer is right on these samples, and how often it misses a force or sees one that isn't there.
ContactScore score(const ContactTree& tree, std::span<const ContactSample> samples);

/// Whether a chip can have sent this: registers within their ranges, AVG between MIN and MAX.
bool is_possible(const ChipStatistics& statistics);

}  // namespace touchstone::sensors
