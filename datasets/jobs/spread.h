#pragma once
// A number that is drawn at random, as a job file writes it:
//   2.5                                              always this
//   {uniform: [0.5, 2]}                              evenly between two numbers
//   {log_uniform: [0.1, 10]}                         its logarithm evenly
//   {normal: {mean: 1, deviation: 0.1}}              cut off at three deviations, or
//   {normal: {mean: 1, deviation: 0.1, within: [0.8, 1.3]}}
//   {one_of: [1, 2, 4]}                              each as likely
//   {whole: [1, 1000]}                               each whole number from the first to the last as likely

#include <string>
#include <vector>

#include "core/random.h"
#include "core/yaml_reader.h"

namespace touchstone::datasets {

/// A distribution of one number, checked when it is read. A function of random numbers alone: see draw().
struct Spread {
  /// The distributions that a job file can name; `whole` is a whole number, each as likely.
  enum class Kind { constant, uniform, log_uniform, normal, one_of, whole };
  Kind kind = Kind::constant;
  double low = 0.0, high = 0.0;        ///< no draw is outside of them; of a constant both are its value
  double mean = 0.0, deviation = 0.0;  ///< normal, before it is cut off
  std::vector<double> choices;         ///< one_of

  /// Always this value.
  static Spread of(double value);
  /// Evenly between the two. @pre low <= high
  static Spread uniform(double low, double high);

  /// The next draw; how many random numbers it takes depends on what they are.
  double draw(RandomStream& random) const;
  /// For people: "uniform from 0.5 to 2".
  std::string text() const;
};

/// What stands in the braces.
void fields(YamlReader& in, Spread& spread);
/// The range of `allowed` must hold all draws. @throws Error with file and line
void read_value(YamlReader& in, Spread& spread, Allowed allowed);

}  // namespace touchstone::datasets
