#include "sim/scene/camera_pipeline.h"

#include "core/error.h"

namespace touchstone::render {
namespace {

constexpr double kLeastTime_s = 1e-6;
constexpr double kMostTime_s = 1e6;
constexpr double kMostFactor = 1e3;

/// The limits of a factor that a camera sets by itself. `key` is the file's name of them.
void read_limits(YamlReader& in, const char* key, double& lowest, double& highest) {
  Eigen::Vector2d limits(lowest, highest);
  in.optional(key, limits, Allowed::within(1.0 / kMostFactor, kMostFactor));
  if (!in.describing() && !(limits[0] < limits[1])) {
    fail_at(in.where(key), "{}{}: are {} and {}; the second must be larger than the first", in.context(), key,
            limits[0], limits[1]);
  }
  lowest = limits[0];
  highest = limits[1];
}

}  // namespace

EnumNames<JpegChroma> enum_names(JpegChroma) {
  return {{"4:4:4", JpegChroma::full}, {"4:2:0", JpegChroma::quarter}};
}

void fields(YamlReader& in, JpegSettings& jpeg) {
  in.required("quality", jpeg.quality, Allowed::within(1, 100));
  in.optional("chroma", jpeg.chroma);
}

void fields(YamlReader& in, HotPixels& hot) {
  in.required("share", hot.share, Allowed::within(0.0, 0.5));
  in.required("dark_current_e_per_s", hot.dark_current_e_per_s, Allowed::above_up_to(0.0, 1e12));
  in.optional("spread", hot.spread, Allowed::within(0.0, 5.0));
}

void fields(YamlReader& in, AutoExposure& automatic) {
  in.required("time_constant_s", automatic.time_constant_s, Allowed::within(kLeastTime_s, kMostTime_s));
  in.required("mean_level", automatic.mean_level, Allowed::within(0.001, 0.9));
  read_limits(in, "exposure_factors", automatic.lowest, automatic.highest);
}

void fields(YamlReader& in, AutoWhiteBalance& automatic) {
  in.required("time_constant_s", automatic.time_constant_s, Allowed::within(kLeastTime_s, kMostTime_s));
  read_limits(in, "gain_factors", automatic.lowest, automatic.highest);
}

}  // namespace touchstone::render

namespace touchstone::sim {
namespace {

enum class ToneType { linear, srgb, gamma, points };

EnumNames<ToneType> enum_names(ToneType) {
  return {
      {"linear", ToneType::linear}, {"srgb", ToneType::srgb}, {"gamma", ToneType::gamma}, {"points", ToneType::points}};
}

}  // namespace

void fields(YamlReader& in, ToneCurveSpec& tone) {
  auto type = ToneType::linear;
  in.required("type", type);
  if (type == ToneType::linear) tone.curve = render::LinearTone{};
  if (type == ToneType::srgb) tone.curve = render::SrgbTone{};
  if (type == ToneType::gamma) {
    render::GammaTone power;
    in.required("gamma", power.gamma, Allowed::within(0.1, 10.0));
    tone.curve = power;
  }
  if (type == ToneType::points) {
    std::vector<Eigen::Vector2d> points;
    in.required("points", points, Allowed::within(0.0, 1.0));
    if (in.describing()) return;
    try {
      tone.curve = MonotoneCurve(points);
      render::check(tone.curve);
    } catch (const Error& error) {
      fail_at(in.where("points"), "{}points: {}", in.context(), error.what());
    }
  }
}

void fields(YamlReader& in, VignettingSpec& spec) {
  in.exactly_one_of({"polynomial", "points"});
  std::vector<double> polynomial;
  std::vector<Eigen::Vector2d> points;
  in.optional("polynomial", polynomial, Allowed::within(-100.0, 100.0));
  in.optional("points", points, Allowed::within(0.0, 10.0));
  if (in.describing()) return;
  if (in.has("points")) {
    try {
      spec.vignetting = MonotoneCurve(points);
    } catch (const Error& error) {
      fail_at(in.where("points"), "{}points: {}", in.context(), error.what());
    }
    return;
  }
  constexpr std::size_t kMostTerms = 8;
  if (polynomial.empty() || polynomial.size() > kMostTerms) {
    fail_at(in.where("polynomial"), "{}polynomial: has {} numbers; allowed are 1 to {}: a1 of r^2, a2 of r^4, ...",
            in.context(), polynomial.size(), kMostTerms);
  }
  spec.vignetting = polynomial;
}

}  // namespace touchstone::sim
