// Shadows of a DirectBatch: by rays, or by the horizons of a sheet that stands alone.

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>

#include "render/direct/direct_batch.h"

namespace touchstone::render {

/// The tangents of elevation between which a lamp that isn't cut into beams goes down behind a horizon.
float DirectBatch::soft_width(int lane, int lamp, float tangent) const {
  constexpr float kSharp = 0.02f;
  const Lane& one = lanes_[lane];
  const Eigen::Vector3d place(one.place[0], one.place[1], one.place[2]);
  const auto distance = static_cast<float>((lamp_position(field_.lamp(lamp)) - place).norm());
  const auto radius = static_cast<float>(fixture_.lens_radii[lamp]);
  return std::max(kSharp, 2.0f * radius * (1.0f + tangent * tangent) / std::max(distance, 1e-3f));
}

/// What walls hide of a sector they hide from the flattest beam on: the first that they leave light of counts as that.
/// A beam reaches half way to the flatter and the steeper one beside it, one at the rim as far outwards as inwards;
/// aside a sector is looked at in two places, half way to where it ends.
void DirectBatch::find_beams(int lane) {
  float tangents[kMostDirectLamps];
  const float* flow = flows_.data() + static_cast<std::size_t>(lane) * stride_ * 3;
  for (int group = 0; group < fixture_.groups; ++group) {
    const Four x = four(flow + group * 12);
    const Four y = four(flow + group * 12 + 4);
    const Four z = four(flow + group * 12 + 8);
    Eigen::Map<Four>(tangents + group * 4) = z.abs() / (x * x + y * y).max(1e-30f).sqrt();
  }
  const auto first_lit = [&](int lamp) {
    while (lamp >= 0 && tangents[lamp] == 0.0f) lamp = field_.beside[lamp].steeper;
    return lamp;
  };
  const auto azimuth_of = [&](int lamp) {
    const float* from = flow + lamp / 4 * 12 + lamp % 4;
    return SheetHorizons::azimuth(-from[0], -from[4]);
  };
  beams_.sectors.clear();
  beams_.lowest.resize(static_cast<std::size_t>(lamps_));
  beams_.highest.resize(static_cast<std::size_t>(lamps_));
  for (int head = 0; head < lamps_; ++head) {
    if (fixture_.flattest[head] != head) continue;
    const int flattest = first_lit(head);
    if (flattest < 0) continue;
    const float azimuth = azimuth_of(flattest);
    const auto turn_to = [&](int other) {
      if (other < 0) return 0.0f;
      const float turn = azimuth_of(other) - azimuth;
      return turn > 2.0f ? turn - 4.0f : turn < -2.0f ? turn + 4.0f : turn;
    };
    const int to_left = first_lit(field_.beside[head].left);
    const int to_right = first_lit(field_.beside[head].right);
    float left = 0.25f * turn_to(to_left);
    float right = 0.25f * turn_to(to_right);
    if (to_left < 0) left = -right;
    if (to_right < 0) right = -left;
    const auto look = [](float towards) {
      const Eigen::Vector2f unit = SheetHorizons::heading(towards);
      return BeamSector::Look{towards, unit.x(), unit.y()};
    };
    beams_.sectors.push_back({flattest, look(azimuth + left), look(azimuth + right)});
    for (int lamp = flattest; lamp >= 0; lamp = field_.beside[lamp].steeper) {
      const int flatter = lamp == flattest ? -1 : field_.beside[lamp].flatter;
      const int steeper = field_.beside[lamp].steeper;
      const float tangent = tangents[lamp];
      float down = flatter >= 0 ? 0.5f * (tangent - tangents[flatter]) : 0.0f;
      float up = steeper >= 0 ? 0.5f * (tangents[steeper] - tangent) : 0.0f;
      if (flatter < 0 && steeper < 0) down = up = 0.5f * soft_width(lane, lamp, tangent);
      if (flatter < 0) down = up;
      if (steeper < 0) up = down;
      beams_.lowest[static_cast<std::size_t>(lamp)] = tangent - down;
      beams_.highest[static_cast<std::size_t>(lamp)] = tangent + up;
    }
  }
}

/// Of the lanes that the first surface's own horizons may shade.
void DirectBatch::dim_by_horizons(int packet) {
  const int first = packet * kPacket;
  unsigned shaded = 0;
  for (int k = 0; k < kPacket; ++k) {
    const Lane& one = lanes_[first + k];
    if (takes_light(first + k) && one.object == 0 && frame_.horizons->any(one.place[0], one.place[1]))
      shaded |= 1u << k;
  }
  if (shaded == 0) return;
  find_beams(first + std::countr_zero(shaded));
  for (int k = 0; k < kPacket; ++k) {
    float horizons[SheetHorizons::kAround] = {};
    around_.rise_x[k] = around_.rise_y[k] = 0.0f;
    if ((shaded >> k & 1u) != 0) {
      const Lane& here = lanes_[first + k];
      frame_.horizons->at(here.place[0], here.place[1], horizons);
      // Across; the place's normal faces the camera and so the light's side.
      const float per_z = 1.0f / std::max(std::abs(here.normal[2]), 1e-6f);
      around_.rise_x[k] = -here.normal[0] * per_z;
      around_.rise_y[k] = -here.normal[1] * per_z;
    }
    for (int number = 0; number < SheetHorizons::kAround; ++number) around_.tangents[number][k] = horizons[number];
  }
  const std::uint64_t touched = shares_over_horizons(around_, beams_, field_.beside, shares_.data());
  for (std::uint64_t rest = touched; rest != 0; rest &= rest - 1) {
    const int lamp = std::countr_zero(rest);
    const float* const share = shares_.data() + static_cast<std::size_t>(lamp) * kPacket;
    for (int k = 0; k < kPacket; ++k) {
      if ((shaded >> k & 1u) != 0) amounts(first + k)[lamp] *= share[k];
    }
  }
}

Eigen::Vector3f DirectBatch::direction_to(int lane, int lamp) const {
  const float* from = directions_.data() + static_cast<std::size_t>(lane) * stride_ * 3 + lamp / 4 * 12 + lamp % 4;
  return {from[0], from[4], from[8]};
}

void DirectBatch::set_flow(int lane, int lamp, const Eigen::Vector3f& flow) {
  float* to = flows_.data() + static_cast<std::size_t>(lane) * stride_ * 3 + lamp / 4 * 12 + lamp % 4;
  for (int a = 0; a < 3; ++a) to[4 * a] = flow[a];
  if ((lanes_[lane].doubt >> lamp & 1u) == 0) return;
  const Eigen::Vector3f direction = -flow.normalized();
  float* direction_at = directions_.data() + (to - flows_.data());
  for (int a = 0; a < 3; ++a) direction_at[4 * a] = direction[a];
}

// The field of a lens point is that of the lens's middle seen from a place shifted in the opposite direction, since
// flat layers look alike from everywhere; a source that is higher is one that is set off along its own ray.
void DirectBatch::choose_lens_points(int lane, double u, double v) {
  Lane& one = lanes_[lane];
  one.spread[0] = static_cast<float>(u - 0.5);
  one.spread[1] = static_cast<float>(v - 0.5);
  if (!takes_light(lane)) return;
  const bool metal = one.material->kind == DirectKind::kMetal;
  for (int lamp = 0; lamp < lamps_; ++lamp) {
    // Shadows are softened by round lenses and chips; those of other lamps fall as from the middle of their light.
    const double radius = fixture_.lens_radii[lamp];
    if (amounts(lane)[lamp] == 0.0f || radius == 0.0) continue;
    if (!metal && (one.doubt >> lamp & 1u) == 0) continue;  // nobody asks where it comes from
    const Eigen::Vector2d lens = radius * square_to_disc(u, v);
    const NormalFrame& frame = fixture_.lens_frames[lamp];
    const Eigen::Vector3d offset = lens.x() * frame.x + lens.y() * frame.y;
    const Eigen::Vector3d flows = flow_of(lane, lamp).cast<double>();
    const Eigen::Vector2d across =
        flows.head<2>() * (field_.index / fixture_.lamp_index[lamp] / flows.norm());  // as the lamp sends it
    const double along2 = 1.0 - across.squaredNorm();
    if (!(along2 > 1e-3)) continue;
    const Eigen::Vector2d shift =
        offset.head<2>() - across * (offset.z() / std::copysign(std::sqrt(along2), flows.z()));
    float flow[4 * kMostDirectLamps];
    look_up_flow(field_,
                 find_cell(field_, one.place[0] - static_cast<float>(shift.x()),
                           one.place[1] - static_cast<float>(shift.y()), one.place[2]),
                 flow);
    const float* turned = flow + 4 * lamp;
    if (turned[3] > 0.0f) set_flow(lane, lamp, {turned[0], turned[1], turned[2]});
  }
}

void DirectBatch::take_as_known(int lane, const Visibility& known) {
  Lane& one = lanes_[lane];
  if (!takes_light(lane)) return;
  for (std::uint64_t rest = one.doubt & known.hidden; rest != 0; rest &= rest - 1) {
    amounts(lane)[std::countr_zero(rest)] = 0.0f;
  }
  one.doubt &= ~(known.open | known.hidden);
}

DirectBatch::Visibility DirectBatch::visibility(int lane) const {
  const Lane& one = lanes_[lane];
  Visibility found;
  if (!takes_light(lane)) return found;
  for (int lamp = 0; lamp < lamps_; ++lamp) {
    found.open |= std::uint64_t{amounts(lane)[lamp] > 0.0f} << lamp;
  }
  found.hidden = one.doubt & ~found.open;
  return found;
}

void DirectBatch::cast_shadows(DirectCounts& counts) {
  const int lane_count = static_cast<int>(rays_.size()) * kPacket;
  std::uint64_t asked = 0;
  for (int lane = 0; lane < lane_count; ++lane) asked |= lanes_[lane].doubt;
  // Packets are filled with one lamp's rays from places beside each other.
  for (; asked != 0; asked &= asked - 1) {
    const int lamp = std::countr_zero(asked);
    // Over a sheet a ray is free if a flatter one of the same azimuth is.
    const int flatter = frame_.shadow_reach->only_sheet() ? field_.beside[lamp].flatter : -1;
    int lanes[kPacket];
    int count = 0;
    for (int lane = 0; lane < lane_count; ++lane) {
      if ((lanes_[lane].doubt >> lamp & 1u) == 0) continue;
      if (flatter >= 0 && amounts(lane)[flatter] > 0.0f) {
        ++counts.spared;
        continue;
      }
      if (!shadow_ray(lane, lamp, count)) {
        ++counts.spared;
        continue;
      }
      lanes[count++] = lane;
      if (count == kPacket) {
        trace_shadows(lamp, lanes, count, counts);
        count = 0;
      }
    }
    if (count > 0) trace_shadows(lamp, lanes, count, counts);
  }
}

/// Where a shadow ray to the lamp goes. A beam is as wide as the directions to the beams beside it differ; one at the
/// rim is taken to be as wide outwards as it is inwards.
Eigen::Vector3f DirectBatch::towards(int lane, int lamp) const {
  const Eigen::Vector3f middle = direction_to(lane, lamp);
  const BesideBeam& beside = field_.beside[lamp];
  Eigen::Vector3f sum = middle;
  // Each beam begins elsewhere in the sequence, so that a place sees different parts of different beams.
  const auto add_part = [&](float spread, float by, int number, int less, int more) {
    const float at = spread + 0.5f + by * static_cast<float>(number);
    const float share = at - std::floor(at) - 0.5f;
    const bool up = (share > 0.0f && more >= 0) || less < 0;
    const int other = up ? more : less;
    if (other < 0) return;
    const Eigen::Vector3f direction = direction_to(lane, other);
    if (direction != Eigen::Vector3f::Zero()) sum += (up ? share : -share) * (direction - middle);
  };
  const float* spread = lanes_[lane].spread;
  add_part(spread[0], 0.4375f, lamp, beside.flatter, beside.steeper);
  add_part(spread[1], 0.6875f, fixture_.flattest[lamp], beside.left, beside.right);
  return sum.normalized();
}

bool DirectBatch::shadow_ray(int lane, int lamp, int slot) {
  const Lane& one = lanes_[lane];
  const Eigen::Vector3f place(one.place[0], one.place[1], one.place[2]);
  const Eigen::Vector3f towards = this->towards(lane, lamp);
  const Eigen::Vector3f origin(one.leave[0], one.leave[1], one.leave[2]);
  if (!origin.allFinite() || !towards.allFinite() || towards.isZero(0.0f)) return false;
  float far = 1e6f;
  if (towards.z() != 0.0f) {
    // To the layer's end, or to where the ray is clear of everything.
    const bool up = towards.z() > 0.0f;
    const auto end = static_cast<float>(up ? fixture_.high : fixture_.low);
    const float limit = up ? std::min(end, frame_.shadow_reach->high()) : std::max(end, frame_.shadow_reach->low());
    far = std::min(far, std::max(0.0f, (limit - origin.z()) / towards.z()));
  }
  if (fixture_.lamp_in_layer[lamp]) {
    far = std::min(far, static_cast<float>((lamp_position(field_.lamp(lamp)) - place.cast<double>()).norm()));
  }
  for (int a = 0; a < 3; ++a) {
    shadow_.origin[a][slot] = origin[a];
    shadow_.direction[a][slot] = towards[a];
  }
  shadow_.far[slot] = far;
  return far > 0.0f;
}

void DirectBatch::trace_shadows(int lamp, const int* lanes, int count, DirectCounts& counts) {
  for (int slot = 0; slot < kPacket; ++slot) {
    shadow_.valid[slot] = slot < count ? -1 : 0;
    if (slot < count) continue;
    shadow_.far[slot] = 0.0f;
    for (int a = 0; a < 3; ++a) {  // Embree aborts at numbers that aren't finite, also in lanes left out
      shadow_.origin[a][slot] = 0.0f;
      shadow_.direction[a][slot] = a == 2 ? 1.0f : 0.0f;
    }
  }
  alignas(64) int free[kPacket];
  frame_.tree.occluded(shadow_, free);
  for (int slot = 0; slot < count; ++slot) {
    if (free[slot] == 0) amounts(lanes[slot])[lamp] = 0.0f;
  }
  counts.shadow_rays += count;
}

}  // namespace touchstone::render
