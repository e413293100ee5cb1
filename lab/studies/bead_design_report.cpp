// What a study of bead designs is asked in its file, and its answer in words.

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/named_file.h"
#include "lab/studies/bead_design_study.h"

namespace touchstone::sensors {

EnumNames<StopRule> enum_names(StopRule) {
  return {{name_of(StopRule::kLossDrop), StopRule::kLossDrop},
          {name_of(StopRule::kConvergence), StopRule::kConvergence}};
}

}  // namespace touchstone::sensors

namespace touchstone::lab {
namespace {

/// Above this part of the wanted error the bound leaves estimators no margin.
constexpr double kBoundLeavesMargin = 0.5;

class Story {
 public:
  Story(const BeadDesignSpec& spec, const DesignTable& table) : spec_(spec), table_(table) {}

  double of(std::size_t design, const char* name) const { return table_.values[design][number(name)]; }
  double base(const char* name) const { return table_.base[number(name)]; }
  std::size_t number(const char* name) const { return figure_number(table_.figures, name, {}); }

  /// What decides: verification and the load itself.
  double error(std::size_t d) const { return std::max(of(d, "error_N"), of(d, "error_at_load_N")); }
  bool bears(std::size_t d) const { return table_.faults[d].empty() && of(d, "range_N") >= spec_.load_N; }
  bool meets(std::size_t d) const { return bears(d) && error(d) <= spec_.error_N; }

  template <typename Better>
  std::optional<std::size_t> best(bool (Story::*admitted)(std::size_t) const, const Better& better) const {
    std::optional<std::size_t> found;
    for (std::size_t d = 0; d < table_.points.size(); ++d) {
      if ((this->*admitted)(d) && (!found || better(d, *found))) found = d;
    }
    return found;
  }

  std::string cost(std::size_t d) const {
    std::string text = "Against the device as it is: ";
    bool first = true;
    for (const auto& [name, what] :
         {std::pair{"range_N", "range {:.3g} N in the place of {:.3g}"},
          {"depth_mm", "the load presses {:.3g} mm in, {:.3g} before"},
          {"largest_strain", "largest strain {:.2g}, {:.2g} before"},
          {"elsewhere_N", "error where it wasn't trained {:.3g} N, {:.3g} before"},
          {"displacement_error_um", "error of a bead's displacement {:.2g} um, {:.2g} before"},
          {"noise_N", "noise without load {:.2g} N, {:.2g} before"}}) {
      const double now = of(d, name), before = base(name);
      text += (first ? "" : "; ") + fmt::format(fmt::runtime(what), now, before);
      first = false;
    }
    return text + ".";
  }

  std::string errors(std::size_t d) const {
    return fmt::format("{:.3g} N in the verification, {:.3g} N at {:.4g} N, range {:.3g} N", of(d, "error_N"),
                       of(d, "error_at_load_N"), spec_.load_N, of(d, "range_N"));
  }

  /// Sensor or algorithm?
  std::string advice(std::size_t d) const {
    const double bound = of(d, "bound_N");
    const double unknown = of(d, "bound_unknown_place_N");
    std::string text = fmt::format(
        "No unbiased estimate from these beads and this light can scatter by less than {:.2g} N there ({:.2g} N if the "
        "place must be found, too); ours is off by {:.3g} N, of which noise is {:.2g} N. ",
        bound, unknown, of(d, "error_at_load_N"), of(d, "noise_N"));
    if (unknown > kBoundLeavesMargin * spec_.error_N) {
      return text +
             "So the sensor is at its limit: more beads, light or softness would help, another estimator hardly.";
    }
    if (of(d, "noise_N") < 0.5 * of(d, "error_at_load_N")) {
      return text +
             "So the sensor knows more than the estimator reads from it: what is off is the estimator's law, not "
             "the noise. Another estimator would help, another sensor need not.";
    }
    return text +
           "So it's the noise of tracking that the estimate suffers from: a better tracker or more light would help.";
  }

 private:
  const BeadDesignSpec& spec_;
  const DesignTable& table_;
};

}  // namespace

void fields(YamlReader& in, BeadDesignSpec& spec) {
  std::string device, object, training, verification;
  in.required("device", device);
  plan_fields(in, spec.plan);
  in.required("object", object);
  in.required("training", training);
  in.optional("training_mm", spec.training_mm);
  in.optional("training_centre", spec.training_centre);
  in.optional("training_ends", spec.training_ends);
  in.required("verification", verification);
  in.optional("elsewhere_mm", spec.elsewhere_mm);
  in.optional("load_N", spec.load_N, Allowed::above(0.0));
  in.optional("error_N", spec.error_N, Allowed::above(0.0));
  in.optional("most_N", spec.most_N, Allowed::above(0.0));
  in.optional("deepest_share", spec.deepest_share, Allowed::above_up_to(0.0, 0.9));
  in.optional("exposures", spec.exposures, Allowed::within(2, 1000));
  if (in.describing()) return;  // the files that it names aren't there
  check_plan(in, spec.plan);
  if (spec.most_N < spec.load_N) {
    fail_at(in.where("most_N"), "most_N: is {}, it must be at least load_N, {}", spec.most_N, spec.load_N);
  }
  spec.object = sim::read_object(named_file(in, "object", object));
  spec.training = read_yaml<sim::MotionSpec>(named_file(in, "training", training));
  spec.verification = read_yaml<sim::MotionSpec>(named_file(in, "verification", verification));
  spec.base = read_design_base(named_file(in, "device", device));
  const sim::DeviceSpec& read = spec.base.device;
  if (!read.beads || !read.camera || read.coating) {
    fail_at(in.where("device"), "device: {} {}; this study needs beads in a clear gel and a camera", read.name,
            !read.beads    ? "has no beads"
            : !read.camera ? "has no camera"
                           : "has a coating");
  }
  check_paths(spec.base, spec.plan);
}

StudyResult report(const std::string& name, const BeadDesignSpec& spec, const DesignTable& table) {
  const Story story(spec, table);
  DesignStory report;
  report.name = name;
  report.title = fmt::format(
      "{} designs; wanted are {:.4g} N, in the verification and at {:.4g} N. An estimate comes from a model that is "
      "trained and verified on each design itself, with the noise that its tracker has on its rendered pictures.",
      table.points.size(), spec.error_N, spec.load_N);
  const auto by_error = [&](std::size_t a, std::size_t b) { return story.error(a) < story.error(b); };
  const auto by_range = [&](std::size_t a, std::size_t b) { return story.of(a, "range_N") > story.of(b, "range_N"); };
  const auto nearest = story.best(&Story::bears, by_error);
  std::size_t meeting = 0, bearing = 0;
  for (std::size_t d = 0; d < table.points.size(); ++d) {
    meeting += story.meets(d);
    bearing += story.bears(d);
  }
  report.answer = fmt::format("{} of {} designs bear {:.4g} N, {} of them with the wanted error.\n\n", bearing,
                              table.points.size(), spec.load_N, meeting);
  if (nearest) {
    report.chosen.push_back(*nearest);
    report.answer +=
        fmt::format("**{}: {}** ({}). {}\n\n{}\n", meeting > 0 ? "The smallest error" : "None meets it. Nearest comes",
                    name_of_point(table.plan, table.points[*nearest]), story.errors(*nearest), story.cost(*nearest),
                    story.advice(*nearest));
    if (const auto widest = story.best(&Story::meets, by_range); widest && *widest != *nearest) {
      report.chosen.push_back(*widest);
      report.answer +=
          fmt::format("\n**The largest range that still meets it: {}** ({}). {}\n",
                      name_of_point(table.plan, table.points[*widest]), story.errors(*widest), story.cost(*widest));
    }
  }
  report.answer += fmt::format(
      "\nAs it is, the device has {:.3g} N in the verification, {:.3g} N at {:.4g} N, a bound of {:.2g} N and a range "
      "of "
      "{:.3g} N.\n",
      story.base("error_N"), story.base("error_at_load_N"), spec.load_N, story.base("bound_N"), story.base("range_N"));
  std::optional<double> least;
  for (std::size_t d = 0; d < table.points.size(); ++d) {
    const double ratio = story.of(d, "error_over_bound");
    if (std::isfinite(ratio) && (!least || ratio < *least)) least = ratio;
  }
  if (least) {
    report.answer +=
        *least >= 1.0
            ? fmt::format("\nNo design's error is below its bound: the least is {:.3g} times as large.\n", *least)
            : fmt::format(
                  "\nThe least error is {:.3g} times its bound: an estimate that is biased towards "
                  "what it was trained on can scatter less than an unbiased one.\n",
                  *least);
  }
  report.pareto = {story.number("error_N"), story.number("range_N"), story.number("bound_N")};
  for (const char* drawn :
       {"error_N", "error_at_load_N", "bound_N", "range_N", "displacement_error_um", "largest_strain"}) {
    report.drawn.push_back(story.number(drawn));
  }
  return design_report(table, report);
}

}  // namespace touchstone::lab
