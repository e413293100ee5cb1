#include "sensors/reflex/contact_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/random.h"

namespace touchstone::sensors {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

ChipStatistics statistics(int maximum, int squal, int minimum = 5, double average = 15.0) {
  return {.maximum = maximum, .minimum = minimum, .squal = squal, .average = average};
}

/// How many answers the tree has.
int leaves_of(const ContactTree& tree) {
  return static_cast<int>(
      std::count_if(tree.nodes.begin(), tree.nodes.end(), [](const ContactTreeNode& node) { return node.above == 0; }));
}

/// [Knoop2013, eq. 2] as a tree.
ContactTree text_tree() {
  ContactTree tree;
  tree.nodes.resize(7);
  tree.nodes[0] = {ChipFeature::maximum, 40.0, 1, 2, false};
  tree.nodes[1].force_present = true;
  tree.nodes[2] = {ChipFeature::maximum, 38.0, 3, 4, false};
  tree.nodes[3] = {ChipFeature::squal, 81.0, 5, 6, false};
  tree.nodes[6].force_present = true;
  return tree;
}

/// 1000 statistics of which the paper's rule holds, a part of them with the wrong label.
std::vector<ContactSample> samples_of_the_text(double wrong, std::uint64_t index = 0) {
  RandomStream random(1, index, Purpose::kTest);
  std::vector<ContactSample> samples;
  for (int i = 0; i < 1000; ++i) {
    const int maximum = 34 + static_cast<int>(12.0 * random.uniform());
    const int minimum = 3 + static_cast<int>(4.0 * random.uniform());
    const ChipStatistics one =
        statistics(maximum, 60 + static_cast<int>(40.0 * random.uniform()), minimum, 14.0 + 3.0 * random.uniform());
    samples.push_back({one, force_present(text_tree(), one) != (random.uniform() < wrong)});
  }
  return samples;
}

TEST(ContactTree, IsPrintedAsTheTextPrintsIt) {
  EXPECT_EQ(rule_of(text_tree()), "MAX > 40 or (MAX > 38 and SQ < 82)");
  ContactTree answer;
  answer.nodes.resize(1);
  EXPECT_EQ(rule_of(answer), "never");
  answer.nodes[0].force_present = true;
  EXPECT_EQ(rule_of(answer), "always");
  ContactTree average;
  average.nodes.resize(3);
  average.nodes[0] = {ChipFeature::average, 15.25, 1, 2, false};
  average.nodes[2].force_present = true;
  EXPECT_EQ(rule_of(average), "AVG <= 15.25");
}

TEST(ContactTree, TheTextsRuleIsLearnedFromItsSamples) {
  const ContactTree tree = train_contact_tree(samples_of_the_text(0.0));
  EXPECT_EQ(rule_of(tree), "MAX > 40 or (MAX > 38 and SQ < 82)");
}

TEST(ContactTree, PruningKeepsTheRuleAndDropsWhatFollowsWrongLabels) {
  const std::vector<ContactSample> samples = samples_of_the_text(0.03);
  const ContactTree pruned = train_contact_tree(samples);
  const ContactTree full = train_contact_tree(samples, {.folds = 1, .least_samples = 2});
  EXPECT_EQ(rule_of(pruned), "MAX > 40 or (MAX > 38 and SQ < 82)");
  EXPECT_GT(leaves_of(full), 3 * leaves_of(pruned));
  // On samples that it hasn't seen the pruned tree is the better one; 3 % of their labels are wrong too.
  const std::vector<ContactSample> others = samples_of_the_text(0.0, 1);
  EXPECT_LT(score(pruned, others).error_percent(), 0.5);
  EXPECT_GT(score(full, others).error_percent(), score(pruned, others).error_percent());
}

TEST(ContactTree, TheSameSamplesGiveTheSameTree) {
  const std::vector<ContactSample> samples = samples_of_the_text(0.05);
  EXPECT_EQ(rule_of(train_contact_tree(samples)), rule_of(train_contact_tree(samples)));
}

TEST(ContactTree, WeightsMoveTheThreshold) {
  // With the odds of a force growing evenly from 0 to 1 over MAX = 0..60, the least expected cost is at 60/(1 +
  // weight).
  RandomStream random(3, 0, Purpose::kTest);
  std::vector<ContactSample> samples;
  for (int i = 0; i < 20000; ++i) {
    const int maximum = static_cast<int>(61.0 * random.uniform());
    samples.push_back({statistics(maximum, 10, 0, 0.0), random.uniform() * 60.0 < maximum});
  }
  for (const double weight : {1.0, 3.0}) {
    const ContactTree tree = train_contact_tree(samples, {.missed_weight = weight});
    int first = 0;
    while (!force_present(tree, statistics(first, 10, 0, 0.0))) ++first;
    EXPECT_NEAR(first, 60.0 / (1.0 + weight), 4.0);
  }
}

TEST(ContactTree, TheRuleSaysWhatTheTreeSays) {
  // The printed parts are read again: for trees of all kinds both must agree everywhere.
  for (std::uint64_t index = 0; index < 5; ++index) {
    const ContactTree tree = train_contact_tree(samples_of_the_text(0.1, index), {.folds = 1, .least_samples = 5});
    const std::string rule = rule_of(tree);
    const auto holds = [&](const ChipStatistics& s) {
      const auto condition = [&](const std::string& text) {
        for (const ChipFeature feature : kChipFeatures) {
          const std::string name = name_of(feature) + " ";
          if (text.rfind(name, 0) != 0) continue;
          const std::string rest = text.substr(name.size());
          if (rest.rfind("> ", 0) == 0) return value_of(s, feature) > std::stod(rest.substr(2));
          if (rest.rfind("< ", 0) == 0) return value_of(s, feature) < std::stod(rest.substr(2));
          return value_of(s, feature) <= std::stod(rest.substr(3));
        }
        ADD_FAILURE() << text;
        return false;
      };
      std::string text = rule;
      text.erase(std::remove_if(text.begin(), text.end(), [](char c) { return c == '(' || c == ')'; }), text.end());
      const auto split = [](const std::string& whole, const std::string& by) {
        std::vector<std::string> parts;
        std::size_t from = 0;
        for (std::size_t at; (at = whole.find(by, from)) != std::string::npos; from = at + by.size()) {
          parts.push_back(whole.substr(from, at - from));
        }
        parts.push_back(whole.substr(from));
        return parts;
      };
      const std::vector<std::string> parts = split(text, " or ");
      return std::any_of(parts.begin(), parts.end(), [&](const std::string& part) {
        const std::vector<std::string> all = split(part, " and ");
        return std::all_of(all.begin(), all.end(), condition);
      });
    };
    int differ = 0, present = 0;
    for (int maximum = 30; maximum < 50; ++maximum) {
      for (int squal = 55; squal < 105; squal += 3) {
        for (const double average : {13.0, 15.1, 16.4}) {
          const ChipStatistics one = statistics(maximum, squal, 4, average);
          differ += holds(one) != force_present(tree, one) ? 1 : 0;
          present += force_present(tree, one) ? 1 : 0;
        }
      }
    }
    EXPECT_GT(present, 0);
    EXPECT_LE(differ, 10) << rule;  // AVG's thresholds are printed with four digits
  }
}

TEST(ContactTree, ScoreCountsBothKindsOfMistakes) {
  const std::vector<ContactSample> samples = {
      {statistics(50, 90), true}, {statistics(30, 90), true}, {statistics(50, 90), false}, {statistics(30, 90), false}};
  const ContactScore result = score(text_tree(), samples);
  EXPECT_EQ(result.missed, 1);
  EXPECT_EQ(result.false_alarms, 1);
  EXPECT_EQ(result.error_percent(), 50.0);
  EXPECT_EQ(score(text_tree(), {}).error_percent(), 0.0);
}

TEST(ContactTree, WhatIsWrongIsNamed) {
  std::vector<ContactSample> samples = samples_of_the_text(0.0);
  const auto train = [&](const ContactTreeSettings& settings) {
    return [&, settings] { train_contact_tree(samples, settings); };
  };
  EXPECT_THAT(train({.folds = 0}), ThrowsMessage<Error>(HasSubstr("folds is 0")));
  EXPECT_THAT(train({.most_depth = 0}), ThrowsMessage<Error>(HasSubstr("most_depth is 0")));
  EXPECT_THAT(train({.most_depth = 15}), ThrowsMessage<Error>(HasSubstr("it must be from 1 to 14")));
  EXPECT_THAT(train({.least_samples = 0}), ThrowsMessage<Error>(HasSubstr("least_samples is 0")));
  EXPECT_THAT(train({.missed_weight = 0.0}), ThrowsMessage<Error>(HasSubstr("missed_weight is 0")));
  samples[7].statistics.squal = 256;
  EXPECT_THAT(train({}), ThrowsMessage<Error>(HasSubstr("sample 7")));
  samples = {{statistics(40, 80), true}, {statistics(30, 80), true}};
  EXPECT_THAT(train({.folds = 1}), ThrowsMessage<Error>(HasSubstr("2 samples with a force and 0 without")));

  ContactTree tree;
  EXPECT_THAT(fault_of(tree), HasSubstr("no node"));
  tree = text_tree();
  EXPECT_EQ(fault_of(tree), "");
  tree.nodes[2].above = 1;  // back: it might never end
  EXPECT_THAT(fault_of(tree), HasSubstr("node 2 leads to node 1"));
  tree = text_tree();
  tree.nodes[3].below = 7;
  EXPECT_THAT(fault_of(tree), HasSubstr("node 3 leads to node 7"));
  tree = {};
  tree.nodes = {{ChipFeature::maximum, 37.0, 1, 1, false}, {}};  // of sixty such nodes, rule_of would never end
  EXPECT_THAT(fault_of(tree), HasSubstr("two paths lead to node 1"));
  tree.nodes.clear();
  for (int i = 0; i <= kDeepestContactTree; ++i) {
    tree.nodes.push_back({ChipFeature::maximum, 37.0, 2 * i + 2, 2 * i + 1, false});
    tree.nodes.emplace_back();
  }
  tree.nodes.emplace_back();
  EXPECT_THAT(fault_of(tree), HasSubstr("behind 15 questions; at most 14 are allowed"));
  tree = text_tree();
  tree.nodes[0].threshold = 40.5;
  EXPECT_THAT(fault_of(tree), HasSubstr("whole number"));
  tree.nodes[0].threshold = std::numeric_limits<double>::infinity();
  EXPECT_THAT(fault_of(tree), HasSubstr("finite"));
}

TEST(ContactTree, ImpossibleStatisticsAreKnown) {
  EXPECT_TRUE(is_possible(statistics(40, 80)));
  EXPECT_TRUE(is_possible(statistics(63, 255, 63, 62.8)));  // Pixel_Sum is rounded down
  EXPECT_FALSE(is_possible(statistics(64, 80)));
  EXPECT_FALSE(is_possible(statistics(40, -1)));
  EXPECT_FALSE(is_possible(statistics(4, 80, 5)));
  EXPECT_FALSE(is_possible(statistics(40, 80, 5, 41.0)));
  EXPECT_FALSE(is_possible(statistics(40, 80, 5, 4.0)));
  EXPECT_FALSE(is_possible(statistics(40, 80, 5, std::nan(""))));
  ChipStatistics moved = statistics(40, 80);
  moved.dx = 128;
  EXPECT_FALSE(is_possible(moved));
  moved.dx = -128;
  moved.dy = -129;
  EXPECT_FALSE(is_possible(moved));
}

}  // namespace
}  // namespace touchstone::sensors
