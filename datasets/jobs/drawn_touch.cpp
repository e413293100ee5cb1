#include "datasets/jobs/drawn_touch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/edited_yaml.h"
#include "core/random.h"
#include "core/random_pairs.h"
#include "core/text_file.h"
#include "core/transform.h"
#include "core/units.h"
#include "sim/sensor/milky_view.h"

namespace touchstone::datasets {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kDeepestShare = 0.4;  // of the gel's thickness, where the job doesn't say
constexpr double kLeastWidest_mm = 0.5;
constexpr double kSpareWidth_mm = 0.2;
constexpr std::int64_t kPiecesChecked = 20;

/// Applies what is to be varied, in order, each to what the ones before it left.
std::string varied(std::string text, const std::string& name, const std::vector<NumberVariation>& all,
                   RandomStream& random, std::vector<DrawnNumber>* drawn) {
  for (const NumberVariation& vary : all) {
    std::vector<std::pair<YamlNumber, double>> changes;
    for (const std::vector<YamlNumber>& group : find_yaml_numbers(text, name, vary.path, vary.where)) {
      const double value = vary.spread.draw(random);
      for (const YamlNumber& number : group) {
        const double now = vary.how == VariationKind::set     ? value
                           : vary.how == VariationKind::times ? number.value * value
                                                              : number.value + value;
        if (!std::isfinite(now)) {
          fail_at(vary.where, "path '{}': {} became {} by {}", vary.path, number.path, now, value);
        }
        changes.emplace_back(number, now);
        if (drawn != nullptr) drawn->emplace_back(number.path, now);
      }
    }
    text = with_yaml_numbers(text, changes);
  }
  return text;
}

template <typename Spec>
Spec read_varied(const std::string& text, const std::string& file, const std::string& who) {
  try {
    return parse_yaml<Spec>(text, file);
  } catch (const Error& error) {
    fail("{}, as drawn: {}", who, error.what());
  }
}

/// The device can give what the job's outputs want.
void require_outputs(const sim::DeviceSpec& device, const DrawJob& job) {
  const DrawnOutputs& wanted = job.outputs;
  const auto refuse = [&](const char* output, const char* missing) {
    fail_at(wanted.where, "outputs: '{}' can't be had of device {}: it has no {}", output, device.name, missing);
  };
  if (wanted.camera() && !device.camera) {
    refuse(wanted.frame ? "frame" : wanted.height ? "height" : wanted.contact ? "contact" : "events", "camera");
  }
  if (wanted.height && !device.coating && !sim::is_milky(device)) {
    refuse("height", "coating, and what its camera sees first isn't its outer face");
  }
  if (wanted.beads && !device.beads) refuse("beads", "beads");
  if (wanted.markers && !device.pins && !(device.coating && device.coating->print)) {
    refuse("markers", "printed coating and no pins");
  }
  if (wanted.events && !device.camera->events) refuse("events", "event pixels (camera: events:)");
  if (wanted.statistics && !device.camera->motion_chip) refuse("statistics", "motion chip (camera: motion_chip:)");
}

void require_touchable(const sim::DeviceSpec& device, const PreparedDraw& prepared) {
  require_outputs(device, prepared.job);
  if (!(prepared.deepest_mm < device.gel.thickness_mm)) {
    fail_at(prepared.job.where, "draw: presses of up to {} mm, but the gel of device {} is {} mm thick",
            prepared.deepest_mm, device.name, device.gel.thickness_mm);
  }
}

std::vector<DrawnBlock> blocks_of(const DrawJob& job) {
  std::vector<DrawnBlock> blocks;
  const std::int64_t units = job.draw.units.count;
  for (std::int64_t unit = 0; unit < units; ++unit) {
    const std::int64_t first = unit * job.samples / units;
    const std::int64_t end = (unit + 1) * job.samples / units;
    for (std::int64_t at = first; at < end; at += job.samples_per_file) {
      DrawnBlock block;
      block.number = static_cast<int>(blocks.size());
      block.unit = static_cast<int>(unit);
      block.first_sample = at;
      block.samples = std::min<std::int64_t>(job.samples_per_file, end - at);
      blocks.push_back(block);
    }
  }
  return blocks;
}

int unit_of(const DrawJob& job, std::int64_t sample) {
  const std::int64_t units = job.draw.units.count;
  std::int64_t unit = sample * units / job.samples;
  while ((unit + 1) * job.samples / units <= sample) ++unit;
  return static_cast<int>(unit);
}

}  // namespace

PreparedDraw prepare_draw(const std::filesystem::path& file) {
  PreparedDraw prepared;
  prepared.file = file;
  prepared.job = read_draw_job(file);
  prepared.text = read_text_file(file);
  const DrawJob& job = prepared.job;
  prepared.device_text = read_text_file(job.draw.device);
  for (const DrawnObjectSpec& object : job.draw.objects) prepared.object_texts.push_back(read_text_file(object.file));
  prepared.effects.elasticity = job.effects.elasticity;
  prepared.effects.fine_relief = job.effects.fine_relief;
  prepared.effects.interreflection = job.effects.interreflection;
  prepared.effects.diffraction = job.effects.diffraction;
  prepared.blocks = blocks_of(job);
  if (job.splits.by == SplitBy::unit) {
    prepared.unit_splits = splits_of_units(job.splits, job.seed, job.draw.units.count);
  }
  const sim::DeviceSpec device = sim::read_device(job.draw.device);
  prepared.deepest_mm = job.draw.deepest_mm ? *job.draw.deepest_mm
                        : job.draw.depth_mm ? job.draw.depth_mm->high
                                            : kDeepestShare * device.gel.thickness_mm;
  prepared.widest_mm = std::max(kLeastWidest_mm, job.draw.drag_mm.high + kSpareWidth_mm);
  require_touchable(device, prepared);
  for (int unit = 0; unit < job.draw.units.count; ++unit) {
    const DrawnUnit drawn = drawn_unit(prepared, unit);
    require_touchable(drawn.device, prepared);
    if (prepared.job.outputs.pictures() &&
        (drawn.device.camera->width != device.camera->width || drawn.device.camera->height != device.camera->height)) {
      fail_at(job.where, "draw.units: unit {} has a picture of another size; a data set's pictures have one size",
              unit);
    }
  }
  for (std::size_t k = 0; k < job.draw.objects.size(); ++k) {
    const std::int64_t pieces =
        job.draw.objects[k].vary.empty() ? 1 : job.draw.objects[k].pieces.value_or(kPiecesChecked);
    for (std::int64_t piece = 0; piece < std::min(pieces, kPiecesChecked); ++piece) {
      sim::contact_shape(drawn_object(prepared, static_cast<int>(k), piece));
    }
  }
  prepared.inputs = input_files(file);
  return prepared;
}

DrawnUnit drawn_unit(const PreparedDraw& prepared, int unit) {
  TS_ASSERT(unit >= 0 && unit < prepared.job.draw.units.count);
  DrawnUnit drawn;
  drawn.number = unit;
  RandomStream random(prepared.job.seed, static_cast<std::uint64_t>(unit), Purpose::kDrawnUnit);
  drawn.seed = next_seed(random);
  const std::string name = prepared.job.draw.device.string();
  drawn.text = varied(prepared.device_text, name, prepared.job.draw.units.vary, random, &drawn.drawn);
  drawn.device = read_varied<sim::DeviceSpec>(drawn.text, name, fmt::format("unit {}", unit));
  drawn.device.accuracy = sim::merged(prepared.job.accuracy, drawn.device.accuracy);
  return drawn;
}

sim::ObjectSpec drawn_object(const PreparedDraw& prepared, int object, std::int64_t piece) {
  const DrawnObjectSpec& spec = prepared.job.draw.objects.at(static_cast<std::size_t>(object));
  const std::string name = spec.file.string();
  // Objects of one job have streams far apart: pieces are fewer than 2^40.
  RandomStream random(prepared.job.seed, (static_cast<std::uint64_t>(object) << 40) + static_cast<std::uint64_t>(piece),
                      Purpose::kDrawnPiece);
  const std::string text =
      varied(prepared.object_texts[static_cast<std::size_t>(object)], name, spec.vary, random, nullptr);
  return read_varied<sim::ObjectSpec>(text, name, fmt::format("piece {} of object {}", piece, object));
}

DrawnTouch drawn_touch(const PreparedDraw& prepared, std::int64_t sample, int attempt) {
  const DrawJob& job = prepared.job;
  TS_ASSERT(sample >= 0 && sample < job.samples && attempt >= 0);
  DrawnTouch touch;
  touch.sample = sample;
  touch.unit = unit_of(job, sample);
  touch.split = job.splits.by == SplitBy::unit ? prepared.unit_splits[static_cast<std::size_t>(touch.unit)]
                                               : split_of_sample(job.splits, job.seed, sample);
  double weights = 0.0;
  for (const DrawnObjectSpec& object : job.draw.objects) weights += object.weight;
  RandomStream random(job.seed, static_cast<std::uint64_t>(sample), Purpose::kDrawnTouch);
  for (touch.attempt = 0; touch.attempt <= attempt; ++touch.attempt) {
    touch.seed = next_seed(random);
    double choice = random.uniform() * weights;
    touch.object = 0;
    while (touch.object + 1 < static_cast<int>(job.draw.objects.size())) {
      choice -= job.draw.objects[static_cast<std::size_t>(touch.object)].weight;
      if (choice < 0.0) break;
      ++touch.object;
    }
    const DrawnObjectSpec& object = job.draw.objects[static_cast<std::size_t>(touch.object)];
    const double piece = random.uniform();
    if (object.vary.empty()) {
      touch.piece = 0;
    } else if (object.pieces) {
      touch.piece =
          std::min(*object.pieces - 1, static_cast<std::int64_t>(piece * static_cast<double>(*object.pieces)));
    } else {
      touch.piece = sample;
    }
    touch.place_mm.x() = job.draw.place_mm.x.draw(random);
    touch.place_mm.y() = job.draw.place_mm.y.draw(random);
    touch.turn_deg = job.draw.turn_deg.draw(random);
    touch.tilt_deg = job.draw.tilt_deg.draw(random);
    touch.tilt_axis_deg = job.draw.tilt_axis_deg.draw(random);
    touch.force_N = job.draw.force_N ? job.draw.force_N->draw(random) : kNone;
    touch.depth_mm = job.draw.depth_mm ? job.draw.depth_mm->draw(random) : kNone;
    touch.drag_mm = job.draw.drag_mm.draw(random);
    touch.drag_toward_deg = job.draw.drag_toward_deg.draw(random);
  }
  touch.attempt = attempt;
  return touch;
}

Eigen::Matrix3d rotation_of(const DrawnTouch& touch) {
  const double toward = touch.tilt_axis_deg * kRadiansPerDegree;
  const Eigen::AngleAxisd tilt(touch.tilt_deg * kRadiansPerDegree,
                               Eigen::Vector3d(std::cos(toward), std::sin(toward), 0.0));
  return tilt.toRotationMatrix() *
         Eigen::AngleAxisd(touch.turn_deg * kRadiansPerDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

sim::PressSpec press_of(const DrawnTouch& touch) {
  const double toward = touch.drag_toward_deg * kRadiansPerDegree;
  sim::PressSpec press;
  press.place_mm = touch.place_mm;
  press.angles_deg = xyz_from_rotation(rotation_of(touch)) / kRadiansPerDegree;
  if (std::isnan(touch.depth_mm)) {
    press.force_N = touch.force_N;
  } else {
    press.depth_mm = touch.depth_mm;
  }
  press.drag_mm = touch.drag_mm * Eigen::Vector2d(std::cos(toward), std::sin(toward));
  return press;
}

}  // namespace touchstone::datasets
