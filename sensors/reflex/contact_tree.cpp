#include "sensors/reflex/contact_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/ml.hpp>
#include <optional>

#include "core/error.h"

namespace touchstone::sensors {
namespace {

constexpr int kLargestPixel = 63;
constexpr int kLargestSqual = 255;
constexpr double kEndless = std::numeric_limits<double>::infinity();

bool is_whole(ChipFeature feature) {
  return feature != ChipFeature::average;
}

/// Statistics with low < feature <= high, feature by feature.
struct Box {
  std::array<double, 4> low{-kEndless, -kEndless, -kEndless, -kEndless};
  std::array<double, 4> high{kEndless, kEndless, kEndless, kEndless};

  bool contains(const Box& other) const {
    for (std::size_t i = 0; i < low.size(); ++i) {
      if (other.low[i] < low[i] || other.high[i] > high[i]) return false;
    }
    return true;
  }
};

/// Whether the tree says 'present' everywhere in the box.
bool all_present(const ContactTree& tree, const Box& box, std::size_t at) {
  const ContactTreeNode& node = tree.nodes[at];
  if (node.above == 0) return node.force_present;
  const auto feature = static_cast<std::size_t>(node.feature);
  const bool may_be_above = box.high[feature] > node.threshold;
  const bool may_be_below = box.low[feature] < node.threshold;
  return (!may_be_above || all_present(tree, box, static_cast<std::size_t>(node.above))) &&
         (!may_be_below || all_present(tree, box, static_cast<std::size_t>(node.below)));
}

/// The boxes of all leaves that say 'present', those above a threshold first.
void collect(const ContactTree& tree, std::size_t at, const Box& box, std::vector<Box>& present) {
  const ContactTreeNode& node = tree.nodes[at];
  if (node.above == 0) {
    if (node.force_present) present.push_back(box);
    return;
  }
  const auto feature = static_cast<std::size_t>(node.feature);
  Box above = box, below = box;
  above.low[feature] = std::max(above.low[feature], node.threshold);
  below.high[feature] = std::min(below.high[feature], node.threshold);
  collect(tree, static_cast<std::size_t>(node.above), above, present);
  collect(tree, static_cast<std::size_t>(node.below), below, present);
}

/// The box without the bounds that needn't be there.
Box widened(const ContactTree& tree, Box box) {
  for (std::size_t i = 0; i < box.low.size(); ++i) {
    for (double* bound : {&box.low[i], &box.high[i]}) {
      const double kept = *bound;
      *bound = bound == &box.low[i] ? -kEndless : kEndless;
      if (!all_present(tree, box, 0)) *bound = kept;
    }
  }
  return box;
}

std::vector<std::string> conditions_of(const Box& box) {
  std::vector<std::string> conditions;
  for (const ChipFeature feature : kChipFeatures) {
    const auto i = static_cast<std::size_t>(feature);
    const std::string name = name_of(feature);
    if (box.low[i] != -kEndless) conditions.push_back(fmt::format("{} > {:.4g}", name, box.low[i]));
    if (box.high[i] == kEndless) continue;
    conditions.push_back(is_whole(feature) ? fmt::format("{} < {:.4g}", name, box.high[i] + 1.0)
                                           : fmt::format("{} <= {:.4g}", name, box.high[i]));
  }
  return conditions;
}

void check(const ContactTreeSettings& settings) {
  if (settings.folds < 1) fail("contact tree: folds is {}, it must be at least 1", settings.folds);
  if (settings.most_depth < 1 || settings.most_depth > kDeepestContactTree) {
    fail("contact tree: most_depth is {}, it must be from 1 to {}", settings.most_depth, kDeepestContactTree);
  }
  if (settings.least_samples < 1)
    fail("contact tree: least_samples is {}, it must be at least 1", settings.least_samples);
  if (!(settings.missed_weight > 0.0) || !std::isfinite(settings.missed_weight)) {
    fail("contact tree: missed_weight is {}, it must be above 0 and finite", settings.missed_weight);
  }
}

/// A question of a tree that is being pruned, with what the samples say of it. Indices as in ContactTreeNode.
struct GrownNode {
  ContactTreeNode node;
  double own_cost = 0.0;  ///< weight of the samples that a leaf in its place would get wrong
};

/// Copies OpenCV's node and all below it.
int copy_node(const cv::ml::DTrees& from, int index, std::vector<GrownNode>& nodes) {
  const cv::ml::DTrees::Node& node = from.getNodes()[static_cast<std::size_t>(index)];
  const auto at = nodes.size();
  nodes.emplace_back();
  if (node.split < 0) return static_cast<int>(at);
  const cv::ml::DTrees::Split& split = from.getSplits()[static_cast<std::size_t>(node.split)];
  ContactTreeNode& copy = nodes[at].node;
  copy.feature = kChipFeatures[static_cast<std::size_t>(split.varIdx)];
  const auto threshold = static_cast<double>(split.c);
  copy.threshold = is_whole(copy.feature) ? std::floor(threshold) : threshold;
  const int above = copy_node(from, node.right, nodes);
  const int below = copy_node(from, node.left, nodes);
  nodes[at].node.above = above;  // `copy` may have moved
  nodes[at].node.below = below;
  return static_cast<int>(at);
}

/// The full tree by OpenCV's CART with Gini's index, and each node's cost as a leaf.
std::vector<GrownNode> grow(std::span<const ContactSample* const> samples, const ContactTreeSettings& settings) {
  cv::Mat features(static_cast<int>(samples.size()), static_cast<int>(kChipFeatures.size()), CV_32FC1);
  cv::Mat answers(static_cast<int>(samples.size()), 1, CV_32SC1);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t k = 0; k < kChipFeatures.size(); ++k) {
      features.at<float>(static_cast<int>(i), static_cast<int>(k)) =
          static_cast<float>(value_of(samples[i]->statistics, kChipFeatures[k]));
    }
    answers.at<int>(static_cast<int>(i)) = samples[i]->force_present ? 1 : 0;
  }
  const cv::Ptr<cv::ml::DTrees> trees = cv::ml::DTrees::create();
  trees->setCVFolds(0);  // OpenCV 4 can't prune: see pruned()
  trees->setMaxDepth(settings.most_depth);
  trees->setMinSampleCount(settings.least_samples);
  trees->setUseSurrogates(false);
  // What OpenCV 4 calls priors it takes for weights of single samples.
  const cv::Mat weights = (cv::Mat_<double>(1, 2) << 1.0, settings.missed_weight);
  trees->setPriors(weights);
  trees->train(cv::ml::TrainData::create(features, cv::ml::ROW_SAMPLE, answers));

  std::vector<GrownNode> nodes;
  copy_node(*trees, trees->getRoots()[0], nodes);
  std::vector<double> present(nodes.size(), 0.0), absent(nodes.size(), 0.0);
  for (const ContactSample* sample : samples) {
    for (std::size_t at = 0;;) {
      (sample->force_present ? present[at] : absent[at]) += sample->force_present ? settings.missed_weight : 1.0;
      const ContactTreeNode& node = nodes[at].node;
      if (node.above == 0) break;
      const bool above = value_of(sample->statistics, node.feature) > node.threshold;
      at = static_cast<std::size_t>(above ? node.above : node.below);
    }
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    nodes[i].node.force_present = present[i] > absent[i];
    nodes[i].own_cost = std::min(present[i], absent[i]);
  }
  return nodes;
}

struct Subtree {
  double cost = 0.0;  ///< of its leaves
  int leaves = 0;
};

Subtree subtree_of(const std::vector<GrownNode>& nodes, int at) {
  const GrownNode& one = nodes[static_cast<std::size_t>(at)];
  if (one.node.above == 0) return {one.own_cost, 1};
  const Subtree above = subtree_of(nodes, one.node.above);
  const Subtree below = subtree_of(nodes, one.node.below);
  return {above.cost + below.cost, above.leaves + below.leaves};
}

/// Finds the node whose subtree spares the least cost a leaf ("weakest link" [Breiman1984, sec. 3.3]).
void find_weakest(const std::vector<GrownNode>& nodes, int at, int& weakest, double& spared) {
  const GrownNode& one = nodes[static_cast<std::size_t>(at)];
  if (one.node.above == 0) return;
  const Subtree subtree = subtree_of(nodes, at);
  const double here = (one.own_cost - subtree.cost) / (subtree.leaves - 1);
  if (here < spared) {
    spared = here;
    weakest = at;
  }
  find_weakest(nodes, one.node.above, weakest, spared);
  find_weakest(nodes, one.node.below, weakest, spared);
}

/// Prunes all that spares at most `price` a leaf; gives the least price at which more would go.
double prune(std::vector<GrownNode>& nodes, double price) {
  constexpr double kRounding = 1e-9;
  for (;;) {
    int weakest = -1;
    double spared = kEndless;
    find_weakest(nodes, 0, weakest, spared);
    if (weakest < 0 || spared > price + kRounding) return spared;
    ContactTreeNode& node = nodes[static_cast<std::size_t>(weakest)].node;
    node.above = node.below = 0;
  }
}

/// Without the nodes that nothing leads to any more.
int compact(const std::vector<GrownNode>& nodes, int at, ContactTree& tree) {
  const std::size_t place = tree.nodes.size();
  tree.nodes.push_back(nodes[static_cast<std::size_t>(at)].node);
  const ContactTreeNode node = tree.nodes.back();
  if (node.above != 0) {
    const int above = compact(nodes, node.above, tree);
    const int below = compact(nodes, node.below, tree);
    tree.nodes[place].above = above;
    tree.nodes[place].below = below;
    tree.nodes[place].force_present = false;
  } else {
    tree.nodes[place] = ContactTreeNode{};
    tree.nodes[place].force_present = node.force_present;
  }
  return static_cast<int>(place);
}

/// What is wrong in a fold of the cross-validation, by the price that the others' tree was pruned with.
void add_fold_cost(std::span<const ContactSample* const> samples, const std::vector<int>& fold_of, int fold,
                   const ContactTreeSettings& settings, const std::vector<double>& prices, std::vector<double>& costs) {
  std::vector<const ContactSample*> others;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (fold_of[i] != fold) others.push_back(samples[i]);
  }
  std::vector<GrownNode> nodes = grow(others, settings);
  const double part = static_cast<double>(others.size()) / static_cast<double>(samples.size());
  for (std::size_t k = 0; k < prices.size(); ++k) {
    prune(nodes, prices[k] * part);
    ContactTree tree;
    compact(nodes, 0, tree);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (fold_of[i] != fold || force_present(tree, samples[i]->statistics) == samples[i]->force_present) continue;
      costs[k] += samples[i]->force_present ? settings.missed_weight : 1.0;
    }
  }
}

/// The price of a leaf by cross-validation [Breiman1984, sec. 3.4]: the k-th sample of each kind is in fold k modulo
/// folds, prices are the geometric means of those at which the whole tree changes.
double best_price(std::span<const ContactSample* const> samples, const ContactTreeSettings& settings) {
  std::vector<int> fold_of(samples.size());
  int seen[2] = {0, 0};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    fold_of[i] = seen[samples[i]->force_present ? 1 : 0]++ % settings.folds;
  }
  std::vector<double> steps = {0.0};
  std::vector<GrownNode> nodes = grow(samples, settings);
  for (double next = prune(nodes, 0.0); next < kEndless; next = prune(nodes, next)) steps.push_back(next);
  std::vector<double> prices;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    prices.push_back(k + 1 < steps.size() ? std::sqrt(steps[k] * steps[k + 1]) : 2.0 * steps[k]);
  }
  std::vector<double> costs(prices.size(), 0.0);
  for (int fold = 0; fold < settings.folds; ++fold) {
    add_fold_cost(samples, fold_of, fold, settings, prices, costs);
  }
  const std::size_t best = static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
  double allowed = costs[best];
  if (settings.one_standard_error) {
    const auto n = static_cast<double>(samples.size());
    allowed += std::sqrt(std::max(costs[best] * (1.0 - costs[best] / n), 0.0));
  }
  std::size_t chosen = best;
  for (std::size_t k = best; k < costs.size(); ++k) {
    if (costs[k] <= allowed) chosen = k;
  }
  return prices[chosen];
}

}  // namespace

std::string name_of(ChipFeature feature) {
  switch (feature) {
    case ChipFeature::maximum:
      return "MAX";
    case ChipFeature::minimum:
      return "MIN";
    case ChipFeature::squal:
      return "SQ";
    case ChipFeature::average:
      return "AVG";
  }
  TS_ASSERT(false);
  return {};
}

bool is_possible(const ChipStatistics& s) {
  // Pixel_Sum is rounded down to 128, so AVG may lie below MIN by that much of 324 pixels.
  constexpr double kAverageStep = 128.0 / 324.0;
  const auto fits = [](int value, int low, int high) { return value >= low && value <= high; };
  return fits(s.dx, -128, 127) && fits(s.dy, -128, 127) && fits(s.maximum, 0, kLargestPixel) &&
         fits(s.minimum, 0, s.maximum) && fits(s.squal, 0, kLargestSqual) && s.average >= s.minimum - kAverageStep &&
         s.average <= s.maximum;
}

std::string fault_of(const ContactTree& tree) {
  if (tree.nodes.empty()) return "the tree has no node";
  const auto count = static_cast<int>(tree.nodes.size());
  // Paths that meet again would double with each node, and rule_of goes along all of them, by recursion.
  std::vector<int> depth(tree.nodes.size(), 0);
  for (int i = 0; i < count; ++i) {
    const ContactTreeNode& node = tree.nodes[static_cast<std::size_t>(i)];
    if (node.above == 0 && node.below == 0) continue;
    for (const int next : {node.above, node.below}) {
      if (next <= i || next >= count) {
        return fmt::format("node {} leads to node {}; from {} to {} may follow it", i, next, i + 1, count - 1);
      }
      int& below = depth[static_cast<std::size_t>(next)];
      if (below > 0) return fmt::format("two paths lead to node {}; one is allowed", next);
      below = depth[static_cast<std::size_t>(i)] + 1;
      if (below > kDeepestContactTree) {
        return fmt::format("node {} is behind {} questions; at most {} are allowed", next, below, kDeepestContactTree);
      }
    }
    if (!std::isfinite(node.threshold)) return fmt::format("node {} has a threshold that isn't finite", i);
    if (is_whole(node.feature) && node.threshold != std::floor(node.threshold)) {
      return fmt::format("node {} asks for {} above {}, which must be a whole number", i, name_of(node.feature),
                         node.threshold);
    }
  }
  return {};
}

std::string rule_of(const ContactTree& tree) {
  std::vector<Box> present;
  collect(tree, 0, {}, present);
  for (Box& box : present) box = widened(tree, box);
  std::vector<Box> parts;
  for (std::size_t i = 0; i < present.size(); ++i) {
    bool covered = false;
    for (std::size_t k = 0; k < present.size() && !covered; ++k) {
      const bool same = present[k].contains(present[i]) && present[i].contains(present[k]);
      covered = k != i && present[k].contains(present[i]) && (!same || k < i);
    }
    if (!covered) parts.push_back(present[i]);
  }
  std::string rule;
  for (const Box& box : parts) {
    const std::vector<std::string> conditions = conditions_of(box);
    if (conditions.empty()) return "always";
    std::string part = conditions.front();
    for (std::size_t i = 1; i < conditions.size(); ++i) part += " and " + conditions[i];
    if (conditions.size() > 1 && parts.size() > 1) part = "(" + part + ")";
    rule += (rule.empty() ? "" : " or ") + part;
  }
  return rule.empty() ? "never" : rule;
}

ContactTree train_contact_tree(std::span<const ContactSample> samples, const ContactTreeSettings& settings) {
  check(settings);
  const auto present = std::count_if(samples.begin(), samples.end(), [](const auto& one) { return one.force_present; });
  const auto absent = static_cast<std::ptrdiff_t>(samples.size()) - present;
  if (present < settings.folds || absent < settings.folds) {
    fail("contact tree: {} samples with a force and {} without; at least {} of both are needed, as many as folds",
         present, absent, settings.folds);
  }
  std::vector<const ContactSample*> all;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const ChipStatistics& s = samples[i].statistics;
    if (!is_possible(s)) {
      fail("contact tree: sample {} has MAX {}, MIN {}, SQ {}, AVG {}; pixels are 0 to 63, SQ 0 to 255", i, s.maximum,
           s.minimum, s.squal, s.average);
    }
    all.push_back(&samples[i]);
  }
  std::vector<GrownNode> nodes = grow(all, settings);
  prune(nodes, settings.folds > 1 ? best_price(all, settings) : 0.0);
  ContactTree tree;
  compact(nodes, 0, tree);
  TS_ASSERT(fault_of(tree).empty());
  return tree;
}

ContactScore score(const ContactTree& tree, std::span<const ContactSample> samples) {
  ContactScore result;
  for (const ContactSample& sample : samples) {
    const bool says = force_present(tree, sample.statistics);
    ++result.samples;
    if (sample.force_present && !says) ++result.missed;
    if (!sample.force_present && says) ++result.false_alarms;
  }
  return result;
}

}  // namespace touchstone::sensors
