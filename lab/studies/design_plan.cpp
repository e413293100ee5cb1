#include "lab/studies/design_plan.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "core/edited_yaml.h"
#include "core/random.h"
#include "core/text_file.h"
#include "render/sampling/sample_sequence.h"

namespace touchstone::lab {
namespace {

double within(const DesignVariable& variable, double share) {
  if (variable.logarithmic) return variable.from * std::pow(variable.to / variable.from, share);
  return variable.from + share * (variable.to - variable.from);
}

std::string with_point(std::string text, const std::string& name, const DesignPlan& plan,
                       const std::vector<double>& point) {
  for (std::size_t v = 0; v < plan.vary.size(); ++v) {
    std::vector<std::pair<YamlNumber, double>> changes;
    for (const auto& group : find_yaml_numbers(text, name, plan.vary[v].path, plan.vary[v].where)) {
      for (const YamlNumber& number : group) changes.emplace_back(number, point[v]);
    }
    text = with_yaml_numbers(text, changes);
  }
  return text;
}

}  // namespace

EnumNames<DesignSampling> enum_names(DesignSampling) {
  return {{"grid", DesignSampling::grid},
          {"latin_hypercube", DesignSampling::latin_hypercube},
          {"sobol", DesignSampling::sobol}};
}

void fields(YamlReader& in, DesignVariable& variable) {
  variable.where = in.where();
  in.required("path", variable.path);
  in.exactly_one_of({"values", "from"});
  in.optional("values", variable.values);
  const bool range = in.has("from") || in.has("to");
  if (range) {
    in.required("from", variable.from);
    in.required("to", variable.to);
    in.optional("logarithmic", variable.logarithmic);
    if (!(variable.from < variable.to)) {
      fail_at(in.where("to"), "to: is {}, it must be above from, {}", variable.to, variable.from);
    }
    if (variable.logarithmic && !(variable.from > 0.0)) {
      fail_at(in.where("from"), "from: is {}, a logarithmic range must begin above 0", variable.from);
    }
  } else {
    if (variable.values.empty()) fail_at(in.where("values"), "values: is empty");
    for (std::size_t k = 1; k < variable.values.size(); ++k) {
      if (!(variable.values[k] > variable.values[k - 1])) {
        fail_at(in.where("values"), "values: {} after {}, they must rise", variable.values[k], variable.values[k - 1]);
      }
    }
  }
}

void plan_fields(YamlReader& in, DesignPlan& plan) {
  in.optional("sampling", plan.sampling);
  in.required("vary", plan.vary);
  if (plan.sampling != DesignSampling::grid) in.required("designs", plan.designs, Allowed::within(1, kMostDesigns));
  in.optional("seed", plan.seed);
}

void check_plan(const YamlReader& in, const DesignPlan& plan) {
  const bool grid = plan.sampling == DesignSampling::grid;
  if (plan.vary.empty()) fail_at(in.where("vary"), "vary: is empty");
  std::set<std::string> paths;
  double count = 1.0;
  for (const DesignVariable& variable : plan.vary) {
    if (!paths.insert(variable.path).second) fail_at(variable.where, "path: {} is varied twice", variable.path);
    if (grid == variable.values.empty()) {
      fail_at(variable.where, "{}: {}", variable.path,
              grid ? "a grid needs values, not a range" : "has values, but only a grid takes them: give from and to");
    }
    if (grid) count *= static_cast<double>(variable.values.size());
  }
  if (count > kMostDesigns) {
    fail_at(in.where("vary"), "vary: {} designs are asked for, at most {} are allowed", count, kMostDesigns);
  }
}

std::vector<std::vector<double>> design_points(const DesignPlan& plan) {
  const std::size_t variables = plan.vary.size();
  std::vector<std::vector<double>> points;
  if (plan.sampling == DesignSampling::grid) {
    points.emplace_back();
    for (const DesignVariable& variable : plan.vary) {
      std::vector<std::vector<double>> longer;
      for (const auto& point : points) {
        for (const double value : variable.values) {
          longer.push_back(point);
          longer.back().push_back(value);
        }
      }
      points = std::move(longer);
    }
    return points;
  }
  const auto designs = static_cast<std::size_t>(plan.designs);
  points.assign(designs, std::vector<double>(variables));
  if (plan.sampling == DesignSampling::sobol) {
    for (std::size_t d = 0; d < designs; ++d) {
      render::SampleSequence sequence(plan.seed, 0, static_cast<std::uint32_t>(d));
      for (std::size_t v = 0; v < variables; v += 2) {
        const auto pair = sequence.next_pair();
        points[d][v] = within(plan.vary[v], pair[0]);
        if (v + 1 < variables) points[d][v + 1] = within(plan.vary[v + 1], pair[1]);
      }
    }
    return points;
  }
  for (std::size_t v = 0; v < variables; ++v) {
    RandomStream random(plan.seed, v, Purpose::kStudy);
    std::vector<std::size_t> strip(designs);
    std::iota(strip.begin(), strip.end(), std::size_t{0});
    for (std::size_t k = designs; k > 1; --k) {
      std::swap(strip[k - 1], strip[static_cast<std::size_t>(random.uniform() * static_cast<double>(k))]);
    }
    for (std::size_t d = 0; d < designs; ++d) {
      const double share = (static_cast<double>(strip[d]) + random.uniform()) / static_cast<double>(designs);
      points[d][v] = within(plan.vary[v], share);
    }
  }
  return points;
}

DesignBase read_design_base(const std::filesystem::path& file) {
  DesignBase base{file, read_text_file(file), {}};
  base.device = parse_yaml<sim::DeviceSpec>(base.text, file.string());
  return base;
}

void check_paths(const DesignBase& base, const DesignPlan& plan) {
  for (const DesignVariable& variable : plan.vary) {
    find_yaml_numbers(base.text, base.file.string(), variable.path, variable.where);
  }
}

sim::DeviceSpec design_at(const DesignBase& base, const DesignPlan& plan, const std::vector<double>& point) {
  TS_ASSERT(point.size() == plan.vary.size());
  const std::string name = base.file.string();
  try {
    return parse_yaml<sim::DeviceSpec>(with_point(base.text, name, plan, point), name);
  } catch (const Error& error) {
    fail("with {}: {}", name_of_point(plan, point), error.what());
  }
}

std::string name_of_point(const DesignPlan& plan, const std::vector<double>& point) {
  std::string text;
  for (std::size_t v = 0; v < point.size(); ++v) {
    text += fmt::format("{}{} {:.4g}", v == 0 ? "" : ", ", plan.vary[v].path, point[v]);
  }
  return text;
}

}  // namespace touchstone::lab
