#pragma once
// Which designs a study tries: numbers of a device's file, varied over a grid or by points that fill a box evenly.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/yaml_reader.h"
#include "sim/scene/device.h"

namespace touchstone::lab {

/// Numbers of the device's file that a study varies together: all that `path` leads to (core/edited_yaml.h) get one
/// value.
struct DesignVariable {
  std::string path;             ///< "gel.thickness_mm"
  std::vector<double> values;   ///< rising; for a grid
  double from = 0.0, to = 0.0;  ///< for the other samplings
  bool logarithmic = false;     ///< between from and to: even in the logarithm
  SourceLocation where;
};

/// How designs are laid out over the variables.
enum class DesignSampling {
  grid,             ///< all combinations of the values
  latin_hypercube,  ///< each variable's range is cut into as many strips as there are designs, one design in each
  sobol,            ///< Owen-scrambled Sobol points, two variables at a time
};
EnumNames<DesignSampling> enum_names(DesignSampling);

/// Which numbers vary, and how many designs there are.
struct DesignPlan {
  DesignSampling sampling = DesignSampling::grid;
  std::vector<DesignVariable> vary;
  int designs = 0;  ///< of samplings other than the grid
  std::uint64_t seed = 1;
};

inline constexpr int kMostDesigns = 10000;  ///< more are refused

void fields(YamlReader& in, DesignVariable& variable);
/// Reads `sampling`, `vary`, `designs` and `seed` of the map that the plan stands in.
void plan_fields(YamlReader& in, DesignPlan& plan);
/// After all fields have been read. @throws Error with file and line for a plan that makes no sense
void check_plan(const YamlReader& in, const DesignPlan& plan);

/// A value for each variable of each design. A grid's last variable goes fastest. A pure function of the plan.
std::vector<std::vector<double>> design_points(const DesignPlan& plan);

/// A device's file whose numbers can be changed.
struct DesignBase {
  std::filesystem::path file;
  std::string text;
  sim::DeviceSpec device;  ///< as the text has it
};

/// @throws Error if the file can't be read or isn't a device's
DesignBase read_design_base(const std::filesystem::path& file);

/// @throws Error if a path of the plan isn't in the device's file
void check_paths(const DesignBase& base, const DesignPlan& plan);

/// The device at a point. @throws Error that names the design if the device doesn't allow it
sim::DeviceSpec design_at(const DesignBase& base, const DesignPlan& plan, const std::vector<double>& point);

/// "gel.thickness_mm 5, beads.spacing_mm 2"
std::string name_of_point(const DesignPlan& plan, const std::vector<double>& point);

}  // namespace touchstone::lab
