#pragma once
// How much larger a printed marker looks when something is pressed on it, against one figure of the device: [Lin2019,
// fig. 4c], by eqs. 1 to 3 (chroma_design.h) and by pressing the gel (pressed_marker.h).

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/yaml_reader.h"
#include "lab/chroma/chroma_design.h"
#include "sim/scene/device.h"
#include "sim/scene/object.h"

namespace touchstone::lab {

/// A figure of a device that a study can vary.
enum class StudyField { gel_thickness_mm, gel_youngs_modulus_MPa, gel_poisson_ratio };
EnumNames<StudyField> enum_names(StudyField);
std::string name_of(StudyField field);  ///< "gel.thickness_mm"
/// The field itself, in a device that can be changed.
double& field_of(sim::DeviceSpec& device, StudyField field);

/// Which figure a study varies, and the values that it takes, rising.
struct VarySpec {
  StudyField field = StudyField::gel_thickness_mm;
  std::vector<double> values;
};
void fields(YamlReader& in, VarySpec& vary);

/// By what a row of the study was found.
enum class ApparentSource {
  formula,  ///< eqs. 1 to 3: the gel is a column under the marker, nothing bends light
  linear,   ///< the gel pressed by linear elasticity, seen through gel and plate
  finite,   ///< the same at finite strain (neo-Hookean)
};
EnumNames<ApparentSource> enum_names(ApparentSource);
/// As in files.
std::string name_of(ApparentSource source);

/// What to study. Lenses look straight at the marker, from where `markers_in_view` markers fill their view.
struct ApparentChangeSpec {
  sim::DeviceSpec device;  ///< a slab of gel behind a plate
  VarySpec vary;
  double marker_mm = 2.0;  ///< side
  int markers_in_view = 10;
  double sensor_mm = kChromaSensorWidth_mm;
  std::vector<double> lenses_mm;         ///< focal lengths
  std::vector<sim::ObjectSpec> objects;  ///< pressed on the marker's middle
  std::vector<double> force_N;           ///< rising
  std::optional<double> friction;        ///< of all objects in the place of their own
  std::vector<ApparentSource> by = {ApparentSource::formula, ApparentSource::linear};
};
/// The fields of a study of this kind, beside `name` and `kind`. @throws Error with file and line
void fields(YamlReader& in, ApparentChangeSpec& spec);

/// The measures of a study: those of chroma_design.h in which the marker stays as large as it is.
inline constexpr ApparentMeasure kStudiedMeasures[] = {
    ApparentMeasure::relative_whole_fixed, ApparentMeasure::relative_film_fixed, ApparentMeasure::picture_film_fixed,
    ApparentMeasure::area_film_fixed};
inline constexpr int kStudiedMeasureCount = 4;  ///< of kStudiedMeasures

/// One press seen by one lens. What couldn't be had is NaN.
struct ApparentChangeRow {
  std::string object;  ///< of the formula: "marker"
  ApparentSource source = ApparentSource::formula;
  double force_N = 0.0;
  double value = 0.0;  ///< of the varied figure
  double lens_mm = 0.0;
  double displacement_mm = 0.0;
  double stretch = 0.0;         ///< of the marker's side
  double largest_strain = 0.0;  ///< of the gel's surface
  double measure[kStudiedMeasureCount] = {};
};

/// What came of a study of this kind.
struct ApparentChangeResult {
  std::vector<ApparentChangeRow> rows;  ///< by source, object, force, lens, value
  std::vector<std::string> notes;       ///< presses that couldn't be had, and why
};

/// @throws Error if a gel can't be had
ApparentChangeResult run_apparent_change(const ApparentChangeSpec& spec, const std::filesystem::path& cache,
                                         const Progress& progress = {});

/// Where one measure is largest over the varied figure.
struct ApparentOptimum {
  ApparentChangeRow of;  ///< what was pressed and seen: object, source, force, lens
  ApparentMeasure measure = ApparentMeasure::relative_whole_fixed;
  double value = 0.0;     ///< of the varied figure: the vertex of the parabola through the best and its neighbours
  double change = 0.0;    ///< the largest of the values that were tried
  bool interior = false;  ///< false: the largest is the first or the last that could be had
};
/// For each object, source, force, lens and measure of which at least one value could be had, in the rows' order.
std::vector<ApparentOptimum> optima_of(const ApparentChangeResult& result);

}  // namespace touchstone::lab
