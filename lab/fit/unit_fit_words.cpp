#include "lab/fit/unit_fit_words.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "fmt/ranges.h"

namespace touchstone::lab {
namespace {

constexpr double kSamePart = 0.02;  // of the largest part: less is left out
constexpr double kAlike = 0.03;     // by which logarithms that are called equal may differ
constexpr double kMoved = 0.1;      // of the largest part: how far it's moved where the words give numbers

using Part = UnidentifiableCombination::Part;

/// Reduced to echelon form by full pivoting: each row has one entry 1 where the others have 0.
Eigen::MatrixXd echelon(Eigen::MatrixXd rows) {
  std::vector<bool> used(static_cast<std::size_t>(rows.cols()), false);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    Eigen::Index best_row = i, best = -1;
    for (Eigen::Index r = i; r < rows.rows(); ++r) {
      for (Eigen::Index c = 0; c < rows.cols(); ++c) {
        if (used[static_cast<std::size_t>(c)]) continue;
        if (best < 0 || std::abs(rows(r, c)) > std::abs(rows(best_row, best))) {
          best_row = r;
          best = c;
        }
      }
    }
    if (best < 0 || rows(best_row, best) == 0.0) return rows.topRows(i);
    rows.row(i).swap(rows.row(best_row));
    used[static_cast<std::size_t>(best)] = true;
    rows.row(i) /= rows(i, best);
    for (Eigen::Index r = 0; r < rows.rows(); ++r) {
      if (r != i) rows.row(r) -= rows(r, best) * rows.row(i);
    }
  }
  return rows;
}

std::string list_of(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += fmt::format("{}`{}`", i == 0 ? "" : i + 1 == names.size() ? " and " : ", ", names[i]);
  }
  return text;
}

std::string words_of(const std::vector<Part>& parts) {
  if (parts.size() == 1) {
    return fmt::format("`{}`: what was recorded hardly depends on it, or not at all", parts.front().name);
  }
  std::vector<std::string> up, down;
  bool alike = true;
  for (const Part& part : parts) {
    alike =
        alike && part.how == UnknownHow::times && std::abs(std::abs(part.move) - std::abs(parts.front().move)) < kAlike;
    (part.move > 0.0 ? up : down).push_back(part.name);
  }
  if (alike && (up.empty() || down.empty())) {
    return fmt::format("{} only relative to each other: one factor of all of them changes nothing",
                       list_of(up.empty() ? down : up));
  }
  if (alike && up.size() == 1 && down.size() == 1)
    return fmt::format("{} and `{}` only as their product", list_of(up), down.front());
  if (alike) {
    const auto& one = up.size() < down.size() ? up : down;
    const auto& other = up.size() < down.size() ? down : up;
    return fmt::format("{} and {} only as {}: what a factor of {} adds, its inverse on {} takes away", list_of(one),
                       list_of(other), one.size() == 1 && other.size() > 1 ? "their products" : "products",
                       list_of(one), list_of(other));
  }
  std::string text = "nothing changes that could be noticed where at once";
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Part& part = parts[i];
    text +=
        part.how == UnknownHow::times
            ? fmt::format("{} `{}` is multiplied by {:.3g}", i == 0 ? "" : ",", part.name, std::exp(kMoved * part.move))
            : fmt::format("{} {:+.3g} is added to `{}`", i == 0 ? "" : ",", kMoved * part.move, part.name);
  }
  return text;
}

}  // namespace

std::vector<UnidentifiableCombination> unidentifiable_combinations(const std::vector<FitUnknown>& unknowns,
                                                                   const Eigen::MatrixXd& unidentified,
                                                                   const Eigen::VectorXd& scale) {
  TS_ASSERT(unidentified.rows() == scale.size() && unidentified.rows() == static_cast<Eigen::Index>(unknowns.size()));
  std::vector<UnidentifiableCombination> all;
  if (unidentified.cols() == 0) return all;
  const Eigen::MatrixXd rows = echelon(unidentified.transpose());
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    const double most = rows.row(r).cwiseAbs().maxCoeff();
    UnidentifiableCombination combination;
    double largest = 0.0;
    for (Eigen::Index k = 0; k < rows.cols(); ++k) {
      if (std::abs(rows(r, k)) < kSamePart * most) continue;
      const FitUnknown& unknown = unknowns[static_cast<std::size_t>(k)];
      combination.parts.push_back({unknown.name, unknown.how, rows(r, k) * scale[k]});
      largest = std::max(largest, std::abs(combination.parts.back().move));
    }
    for (Part& part : combination.parts) part.move /= largest;
    combination.words = words_of(combination.parts);
    all.push_back(std::move(combination));
  }
  return all;
}

}  // namespace touchstone::lab
