#include "lab/fit/unit_fit_spec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>

#include "core/error.h"
#include "core/named_file.h"
#include "core/short_text.h"
#include "core/text_file.h"
#include "datasets/jobs/input_files.h"
#include "datasets/jobs/job.h"
#include "sim/relief/relief.h"

namespace touchstone::lab {
namespace {

constexpr double kDeepestShare = 0.4;  // of the gel's thickness, where no depth is known
constexpr double kFinestField = 1e-4, kCoarsestField = 0.2;
constexpr double kSpareDepth = 1.2;  // beyond the deepest press, while depths are looked for

/// What the imager makes of light; all else of `camera` changes the light itself.
bool is_of_imager(const std::string& path) {
  static constexpr std::array kKeys = {"exposure_us",
                                       "gain_dB",
                                       "full_well_e",
                                       "read_noise_e",
                                       "dark_current_e_per_s",
                                       "prnu",
                                       "dsnu_e",
                                       "bits",
                                       "white_balance",
                                       "black_level_DN",
                                       "tone_curve",
                                       "hot_pixels",
                                       "active_area_um2",
                                       "quantum_efficiency_red",
                                       "quantum_efficiency_green",
                                       "quantum_efficiency_blue"};
  return std::any_of(kKeys.begin(), kKeys.end(), [&](const char* key) {
    const std::string whole = std::string("camera.") + key;
    return path == whole || path.starts_with(whole + "[") || path.starts_with(whole + ".");
  });
}

FittedNumber fitted_number(const YamlNumber& number, const sim::GelSpec& gel) {
  FittedNumber fitted{number, NumberActs::on_scene, -1};
  if (is_of_imager(number.path)) {
    fitted.acts = NumberActs::on_imager;
  } else if (number.path == "gel.youngs_modulus_MPa" && gel.layers.empty()) {
    fitted.acts = NumberActs::on_force;
  } else if (number.path == "room_radiance" || number.path.starts_with("room_radiance[")) {
    fitted.acts = NumberActs::on_lamp_power;
  } else if (number.path.starts_with("lamps[")) {
    const std::size_t close = number.path.find(']');
    fitted.lamp = std::stoi(number.path.substr(6, close - 6));
    const std::string field = number.path.substr(std::min(number.path.size(), close + 2));
    const bool power = field == "power_W" || field.starts_with("power_W[");
    fitted.acts = power ? NumberActs::on_lamp_power : NumberActs::on_lamp;
  }
  return fitted;
}

std::vector<FitUnknown> unknowns_of(const UnitFitSpec& spec, const std::string& text, const sim::GelSpec& gel) {
  std::vector<FitUnknown> unknowns;
  std::set<std::string> taken;
  for (const UnknownSpec& asked : spec.unknowns) {
    std::vector<FitUnknown> found;
    std::vector<std::vector<YamlNumber>> groups;
    for (const std::string& path : asked.paths) {
      const auto more = find_yaml_numbers(text, spec.device.string(), path, asked.where);
      groups.insert(groups.end(), more.begin(), more.end());
    }
    for (const std::vector<YamlNumber>& group : groups) {
      if (found.empty() || !asked.together) {
        const std::string& first = group.front().path;
        const std::string own = group.size() > 1 ? first.substr(0, first.rfind('[')) : first;  // a list's own name
        found.push_back({asked.together ? asked.path : own, asked.path, asked.how, asked.low, asked.high, {}});
      }
      const bool dark = std::all_of(group.begin(), group.end(), [](const YamlNumber& one) { return one.value == 0.0; });
      if (asked.how == UnknownHow::times && dark) {
        fail_at(asked.where, "path '{}': {} is 0, which no factor changes; use `plus`", asked.path, group.front().path);
      }
      for (const YamlNumber& number : group) {
        if (!taken.insert(number.path).second) {
          fail_at(asked.where, "path '{}': {} is an unknown already", asked.path, number.path);
        }
        found.back().numbers.push_back(fitted_number(number, gel));
      }
    }
    unknowns.insert(unknowns.end(), found.begin(), found.end());
  }
  return unknowns;
}

void require_fit(const sim::DeviceSpec& device) {
  if (!device.camera) fail_at(device.where, "device {}: has no camera; a fit compares pictures", device.name);
  if (!device.coating) {
    fail_at(device.where, "device {}: has no coating; only coated devices can be fitted", device.name);
  }
  if (device.films || device.beads) {
    fail_at(device.where, "device {}: has {}; a fit can't have it", device.name, device.films ? "films" : "beads");
  }
  if (device.bands) {
    fail_at(device.where, "device {}: has `bands`; a fit takes devices with band_wavelengths_nm", device.name);
  }
  if (device.lamps.empty()) fail_at(device.where, "device {}: has no lamps", device.name);
  if (device.camera->auto_exposure || device.camera->auto_white_balance) {
    fail_at(device.where, "device {}: its camera sets its {} by itself; a fit takes cameras that don't, fix it",
            device.name, device.camera->auto_exposure ? "exposure" : "white balance");
  }
  for (const sim::LampSpec& lamp : device.lamps) {
    if (lamp.spectrum) fail_at(lamp.where, "lamps: a lamp with a spectrum can't be fitted; give power_W by bands");
  }
}

/// That something was recorded that the unknown could be identified by.
void require_identifiable(const FitUnknown& unknown, const UnitFitSpec& spec, const SourceLocation& where) {
  const bool modulus = std::any_of(unknown.numbers.begin(), unknown.numbers.end(), [](const FittedNumber& number) {
    return number.number.path.starts_with("gel.") && number.number.path.find("youngs_modulus_MPa") != std::string::npos;
  });
  const bool force = std::any_of(spec.presses.begin(), spec.presses.end(),
                                 [](const RecordedPress& press) { return press.force_N.has_value(); });
  if (modulus && !force) {
    fail_at(
        where,
        "path '{}': no press has a force_N, and without one a modulus can't be identified: shapes don't depend on it",
        unknown.path);
  }
}

}  // namespace

void fields(YamlReader& in, UnknownSpec& unknown) {
  unknown.where = in.where();
  in.exactly_one_of({"path", "paths"});
  in.optional("path", unknown.path);
  in.optional("paths", unknown.paths);
  in.exactly_one_of({"times", "plus"});
  std::vector<double> range;
  for (const auto& [name, how] : {std::pair{"times", UnknownHow::times}, std::pair{"plus", UnknownHow::plus}}) {
    if (!in.has(name)) continue;
    unknown.how = how;
    in.required(name, range, how == UnknownHow::times ? Allowed::above(0.0) : Allowed::any());
  }
  in.optional("together", unknown.together);
  if (in.describing()) return;
  if (in.has("paths")) {
    if (unknown.paths.size() < 2) {
      fail_at(in.where("paths"), "{}paths: has {}; it names two or more, one alone is a `path`", in.context(),
              unknown.paths.size());
    }
    unknown.together = true;
    for (const std::string& path : unknown.paths) unknown.path += (unknown.path.empty() ? "" : ", ") + path;
  } else {
    unknown.paths = {unknown.path};
  }
  const bool times = unknown.how == UnknownHow::times;
  const double still = times ? 1.0 : 0.0;
  if (range.size() != 2 || !(range[0] <= still && still <= range[1] && range[0] < range[1])) {
    fail_at(
        in.where(times ? "times" : "plus"),
        "{}{}: must be two numbers, from one of at most {} to a larger one of at least {}: the fit begins with what "
        "the device's file says",
        in.context(), times ? "times" : "plus", still, still);
  }
  unknown.low = range[0];
  unknown.high = range[1];
}

void fields(YamlReader& in, RecordedPress& press) {
  press.where = in.where();
  press.picture = datasets::existing_file(in, "picture");
  press.object = datasets::existing_file(in, "object");
  in.required("place_mm", press.place_mm);
  in.optional("angles_deg", press.angles_deg, Allowed::within(-360.0, 360.0));
  in.optional("place_sd_mm", press.place_sd_mm, Allowed::at_least(0.0));
  in.optional("depth_mm", press.depth_mm, Allowed::above(0.0));
  in.optional("depth_sd_mm", press.depth_sd_mm, Allowed::at_least(0.0));
  in.optional("force_N", press.force_N, Allowed::above(0.0));
  in.optional("force_sd_N", press.force_sd_N, Allowed::above(0.0));
  if (in.describing()) return;
  if (!press.depth_mm && !press.force_N)
    fail_at(press.where, "{}a press needs depth_mm, force_N or both", in.context());
  if (press.force_N.has_value() != in.has("force_sd_N")) {
    fail_at(press.where, "{}force_N and force_sd_N (one standard deviation of what was read) stand together",
            in.context());
  }
  if (in.has("depth_sd_mm") && !press.depth_mm) {
    fail_at(in.where("depth_sd_mm"), "{}depth_sd_mm: belongs to a depth_mm, which isn't there", in.context());
  }
}

void fields(YamlReader& in, RecordingSpec& recording) {
  recording.where = in.where();
  std::string folder;
  in.required("folder", folder);
  recording.folder = in.folder() / folder;
  recording.rest = {"rest.png"};
  in.optional("rest", recording.rest);
  in.required("mm_per_px", recording.mm_per_px, Allowed::above(0.0));
  in.optional("presses", recording.presses);
  in.optional("radius_sd_px", recording.radius_sd_px, Allowed::at_least(0.0));
  if (in.describing()) return;
  if (recording.rest.empty()) fail_at(in.where("rest"), "recording.rest: has none; at least one is needed");
  for (const std::string& name : {std::string("presses.csv"), recording.rest.front()}) {
    if (const std::string fault = fault_of_file(recording.folder / name); !fault.empty()) {
      fail_at(in.where("folder"), "recording.folder: {}", fault);
    }
  }
}

void fields(YamlReader& in, UnitFitSpec& fit) {
  fit.where = in.where();
  in.required("name", fit.name);
  fit.device = datasets::existing_file(in, "device");
  in.required("unknowns", fit.unknowns);
  std::vector<std::string> backgrounds;
  in.optional("backgrounds", backgrounds);
  in.exactly_one_of({"presses", "recording"});
  in.optional("presses", fit.presses);
  in.optional("recording", fit.recording);
  in.not_beside("recording", {"backgrounds"});  // which it has
  in.optional("differences", fit.differences);
  in.optional("coarse_px", fit.coarse_px, Allowed::within(1, 32));
  in.optional("deepest_mm", fit.deepest_mm, Allowed::above(0.0));
  in.optional("seed", fit.seed);
  in.optional("field_accuracy", fit.field_accuracy, Allowed::within(kFinestField, kCoarsestField));
  in.optional("membrane_um", fit.membrane_um, Allowed::within(1.0, 1000.0));
  if (in.describing()) return;
  if (!datasets::is_folder_name(fit.name)) {
    fail_at(in.where("name"), "name: '{}' can't name files; allowed are up to 100 letters, digits, - and _",
            short_text(fit.name));
  }
  if (fit.field_accuracy.empty() || std::adjacent_find(fit.field_accuracy.begin(), fit.field_accuracy.end(),
                                                       std::less_equal<>()) != fit.field_accuracy.end()) {
    fail_at(in.where("field_accuracy"), "field_accuracy: must be one number or several, each less than the one before");
  }
  if (fit.unknowns.empty()) fail_at(in.where("unknowns"), "unknowns: has none; at least one is needed");
  if (fit.presses.empty() && !fit.recording) fail_at(in.where("presses"), "presses: has none; at least one is needed");
  if (fit.differences && backgrounds.empty() && !fit.recording) {
    fail_at(in.where("differences"), "differences: true, but there are no `backgrounds` that presses could be less");
  }
  for (const std::string& name : backgrounds) fit.backgrounds.push_back(named_file(in, "backgrounds", name));
}

double number_at(const FitUnknown& unknown, const YamlNumber& number, double x) {
  return unknown.how == UnknownHow::times ? number.value * std::exp(x) : number.value + x;
}

std::string text_at(const PreparedFit& fit, const Eigen::VectorXd& x) {
  TS_ASSERT(x.size() == static_cast<Eigen::Index>(fit.unknowns.size()));
  std::vector<std::pair<YamlNumber, double>> changes;
  for (std::size_t k = 0; k < fit.unknowns.size(); ++k) {
    for (const FittedNumber& number : fit.unknowns[k].numbers) {
      changes.emplace_back(number.number, number_at(fit.unknowns[k], number.number, x[static_cast<Eigen::Index>(k)]));
    }
  }
  return with_yaml_numbers(fit.device_text, changes);
}

sim::DeviceSpec device_at(const PreparedFit& fit, const Eigen::VectorXd& x) {
  try {
    return parse_yaml<sim::DeviceSpec>(text_at(fit, x), fit.spec.device.string());
  } catch (const Error& error) {
    std::string values;
    for (std::size_t k = 0; k < fit.unknowns.size(); ++k) {
      const YamlNumber& first = fit.unknowns[k].numbers.front().number;
      values += fmt::format("{}{} = {:.6g}", k > 0 ? ", " : "", first.path,
                            number_at(fit.unknowns[k], first, x[static_cast<Eigen::Index>(k)]));
    }
    fail_at(fit.spec.where, "the device can't have {}, which the unknowns' ranges allow: {}", values, error.what());
  }
}

PreparedFit prepare_fit(const UnitFitSpec& spec) {
  PreparedFit fit;
  fit.spec = spec;
  fit.device_text = read_text_file(spec.device);
  fit.device = parse_yaml<sim::DeviceSpec>(fit.device_text, spec.device.string());
  require_fit(fit.device);
  if (fit.device.camera->width % spec.coarse_px != 0 || fit.device.camera->height % spec.coarse_px != 0) {
    fail_at(spec.where,
            "coarse_px: {} doesn't divide the picture's {} x {} pixels; allowed are 1 and what divides both",
            spec.coarse_px, fit.device.camera->width, fit.device.camera->height);
  }
  fit.unknowns = unknowns_of(spec, fit.device_text, fit.device.gel);
  std::size_t asked = 0;
  for (const FitUnknown& unknown : fit.unknowns) {
    while (spec.unknowns[asked].path != unknown.path) ++asked;
    require_identifiable(unknown, spec, spec.unknowns[asked].where);
  }
  // Both ends of each range, before minutes of work.
  for (std::size_t k = 0; k < fit.unknowns.size(); ++k) {
    const FitUnknown& unknown = fit.unknowns[k];
    for (const double end : {unknown.low, unknown.high}) {
      Eigen::VectorXd x = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(fit.unknowns.size()));
      x[static_cast<Eigen::Index>(k)] = unknown.how == UnknownHow::times ? std::log(end) : end;
      require_fit(device_at(fit, x));
    }
  }
  double deepest = 0.0;
  bool all_known = true;
  for (const RecordedPress& press : spec.presses) {
    fit.objects.push_back(press.body ? *press.body : sim::read_object(press.object));
    if (fit.objects.back().elastic) {
      fail_at(press.where, "object {}: is elastic; a fit takes rigid ones", fit.objects.back().name);
    }
    all_known = all_known && press.depth_mm;
    deepest = std::max(deepest, press.depth_mm.value_or(0.0) + 3.0 * press.depth_sd_mm);
  }
  const double thickness = fit.device.gel.thickness_mm;
  fit.deepest_mm = spec.deepest_mm ? *spec.deepest_mm
                   : all_known     ? kSpareDepth * deepest
                                   : std::max(kSpareDepth * deepest, kDeepestShare * thickness);
  if (!(fit.deepest_mm < thickness && deepest <= fit.deepest_mm)) {
    fail_at(spec.where, "presses of up to {:.3g} mm (deepest_mm {:.3g}), but the gel of device {} is {} mm thick",
            deepest, fit.deepest_mm, fit.device.name, thickness);
  }
  return fit;
}

PreparedFit prepare_fit(const std::filesystem::path& file) {
  return prepare_fit(read_yaml<UnitFitSpec>(file));
}

}  // namespace touchstone::lab
