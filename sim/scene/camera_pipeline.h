#pragma once
// What a device file's camera says of the steps between the sensor's numbers and the picture that it delivers: the
// blocks `tone_curve`, `jpeg`, `hot_pixels`, `auto_exposure`, `auto_white_balance`, and a lens's `vignetting`.

#include "core/yaml_reader.h"
#include "render/cameras/lens_camera.h"
#include "render/imager/imager.h"

namespace touchstone::render {

// Found by their arguments' namespace, as core/yaml_reader.h has it.
EnumNames<JpegChroma> enum_names(JpegChroma);
void fields(YamlReader& in, JpegSettings& jpeg);
void fields(YamlReader& in, HotPixels& hot);
void fields(YamlReader& in, AutoExposure& automatic);
void fields(YamlReader& in, AutoWhiteBalance& automatic);

}  // namespace touchstone::render

namespace touchstone::sim {

/// `tone_curve: {type: linear | srgb | gamma | points, ...}`
struct ToneCurveSpec {
  render::ToneCurve curve;
};
void fields(YamlReader& in, ToneCurveSpec& tone);

/// `vignetting: {polynomial: [...]}` or `{points: [[r, factor], ...]}`
struct VignettingSpec {
  render::Vignetting vignetting;
};
void fields(YamlReader& in, VignettingSpec& spec);

}  // namespace touchstone::sim
