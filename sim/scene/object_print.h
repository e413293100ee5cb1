#pragma once
// What is printed on an object's touched face: the divisions of a rule, colours, specks, a picture, or the marks of a
// skin. See docs/file-formats.md.
//
// Laid out over the object frame's x and y on the shape's lower side, along z as a relief is. Layers lie one over the
// other, the last one on top; a layer that is a picture (`image`, `skin`) must be the first. Seen through a clear gel
// only: under a coating the plan leaves print out.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <variant>
#include <vector>

#include "core/yaml_reader.h"
#include "render/materials/print.h"
#include "sim/files/colour.h"
#include "sim/scene/contact_pressure.h"
#include "sim/scene/skin_print.h"

namespace touchstone::sim {

/// A row of `count` parallel lines. They run along y, one beside the other along x.
struct RuleScale {
  double pitch_mm = 0.0;   ///< from one line's middle to the next one's
  double width_mm = 0.0;   ///< of a line, below the pitch
  double length_mm = 0.0;  ///< of a line, along y
  int count = 0;
  Eigen::Vector2d from_mm = Eigen::Vector2d::Zero();  ///< lower end of the first line's middle
};

/// A rule's engraved divisions, filled with ink up to its face: to the touch it is flat.
struct RulePrint {
  static constexpr const char* kType = "rule";
  std::vector<RuleScale> scales;
  Colour ink = 0.05;
};

/// Discs of colours of evenly spaced hues on a circle, the first one on the +x side, counted from x to y.
struct HueCirclePrint {
  static constexpr const char* kType = "hue_circle";
  int patches = 12;
  double radius_mm = 0.0;    ///< of the circle that the discs' centres lie on
  double diameter_mm = 0.0;  ///< of a disc
  double saturation = 1.0;   ///< of HSL in sRGB, as is the lightness
  double lightness = 0.5;
  double first_hue_deg = 0.0;
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
};

/// Discs in no order, such as dirt or moles.
struct SpecksPrint {
  static constexpr const char* kType = "specks";
  int count = 0;
  std::vector<double> diameters_mm;                     ///< each speck takes one of them by chance
  Eigen::Vector2d size_mm = Eigen::Vector2d::Zero();    ///< of the rectangle that holds their centres
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();  ///< of that rectangle
  std::uint64_t seed = 0;
  Colour ink = 0.03;
};

/// An sRGB picture from a file; grey ones are grey inks. A device beholds it as it is: +x to the right, +y down.
struct ImagePrint {
  static constexpr const char* kType = "image";
  std::filesystem::path file;                         ///< PNG, TIFF or JPEG of 8 or 16 bit
  Eigen::Vector2d size_mm = Eigen::Vector2d::Zero();  ///< of the whole picture
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  SourceLocation where;
};

/// One layer of print, with where the file says so.
struct PrintLayer {
  std::variant<RulePrint, HueCirclePrint, SpecksPrint, ImagePrint, SkinPrint> kind;
  SourceLocation where;
};

void fields(YamlReader& in, RuleScale& scale);
void fields(YamlReader& in, RulePrint& print);
void fields(YamlReader& in, HueCirclePrint& print);
void fields(YamlReader& in, SpecksPrint& print);
void fields(YamlReader& in, ImagePrint& print);
void fields(YamlReader& in, PrintLayer& layer);

/// @throws Error with file and line if a picture isn't the first layer
void check_layers(const std::vector<PrintLayer>& layers);

/// Does the print's appearance depend on how the object is pressed?
bool depends_on_pressure(const std::vector<PrintLayer>& layers);

/// sRGB of a hue circle's k-th disc, and where its centre lies.
Eigen::Vector3d disc_srgb(const HueCirclePrint& print, int k);
/// Where the k-th disc's middle lies, mm, object frame.
Eigen::Vector2d disc_centre(const HueCirclePrint& print, int k);

/// All inks, for who chooses bands or judges brightness; for an image those that its colours are mixed of.
std::vector<Colour> inks_of(const std::vector<PrintLayer>& layers);

/// A print whose files are read, ready for any bands and pressures.
struct ReadyPrint {
  std::vector<PrintLayer> layers;
  cv::Mat image;  ///< of an ImagePrint: CV_32FC3, linear parts of R, G, B, 0 to 1
};

/// @throws Error with file and line for an image that can't be read
ReadyPrint ready_print(const std::vector<PrintLayer>& layers);

/// For the renderer, without material coordinates. `ground` is what isn't printed on, `pressure` that on the object's
/// face (null for none), which skins look at.
render::Print object_print(const ReadyPrint& print, const SceneBands& bands, const Colour& ground,
                           const ContactPressure* pressure);

}  // namespace touchstone::sim
