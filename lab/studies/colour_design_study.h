#pragma once
// Designs of a sensor that reads displacements from the hue and place of soft markers behind films (chroma): what its
// calibrated model makes of presses that it wasn't calibrated on, beside the least error that any estimate from the
// same pictures could have.
//
// Each design is set up whole. A ball presses and shears one marker as in [Lin2019, secs. IV.C and D]; the form of
// model that errs least on series left out is calibrated, and tested on shears in another direction.

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/yaml_reader.h"
#include "lab/studies/design_plan.h"
#include "lab/studies/design_table.h"

namespace touchstone::lab {

/// A study of this kind, as its file has it.
struct ColourDesignSpec {
  DesignPlan plan;
  DesignBase base;                                             ///< the device
  Eigen::Vector2d place_mm = {1.5, 1.5};                       ///< the marker next to it is pressed
  double friction = 1.0;                                       ///< of the ball
  double deepest_mm = 3.0;                                     ///< of the press series
  double press_step_mm = 0.25;                                 ///< between its pictures
  std::vector<double> shear_depths_mm = {1.5, 2.0, 2.5, 3.0};  ///< of the series for calibration and test, rising
  double shear_mm = 1.0;                                       ///< how far
  int shear_steps = 5;
  double error_um = 350.0;  ///< wanted, of the largest error of a component
};
void fields(YamlReader& in, ColourDesignSpec& spec);

/// The columns, in their order.
std::vector<DesignFigure> colour_design_figures(const ColourDesignSpec& spec);

/// One design's figures. @throws Error saying why it can't be had
std::vector<double> colour_design(const ColourDesignSpec& spec, const sim::DeviceSpec& device,
                                  const std::filesystem::path& cache);

/// All designs one after the other, each on all threads, and the device as its file has it. Designs whose gels are the
/// same share it through the cache. @throws Error if the device itself can't be had
DesignTable run_colour_design(const ColourDesignSpec& spec, const std::filesystem::path& cache,
                              const Progress& progress = {});

/// Tables and plots of the designs, with their captions.
StudyResult report(const std::string& name, const ColourDesignSpec& spec, const DesignTable& table);

}  // namespace touchstone::lab
