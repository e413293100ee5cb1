#include "render/direct_packet.h"

#include <algorithm>
#include <cmath>

namespace touchstone::render {
namespace {

bool is_lit(DirectKind kind) {
  return kind == DirectKind::kMatt || kind == DirectKind::kMetal;
}

}  // namespace

DirectFixture::DirectFixture(const LightField& of) : field(of) {
  const std::vector<FlatFace>& faces = field.fixture.faces;
  low = field.layer > 0 ? faces[field.layer - 1].z : -INFINITY;
  high = field.layer < static_cast<int>(faces.size()) ? faces[field.layer].z : INFINITY;
  const auto medium_of = [&](int layer) -> const Medium& {
    if (faces.empty()) return field.fixture.media[0];
    return field.fixture.media[layer == 0 ? faces.front().medium_below : faces[layer - 1].medium_above];
  };
  const Medium& medium = medium_of(field.layer);
  for (Eigen::Index band = 0; band < medium.absorption.size(); ++band) {
    absorption[band] = static_cast<float>(medium.absorption[band]);
    absorbs = absorbs || medium.absorption[band] > 0.0;
  }
  for (const Lamp& lamp : field.fixture.lamps) {
    // Shadows are softened by round lenses and chips; those of other lamps fall as from the middle of their light.
    const Eigen::Vector3d direction = std::visit([](const auto& one) { return one.direction; }, lamp);
    lens_frames.emplace_back(direction.normalized());
    const bool is_round = std::holds_alternative<SpotLamp>(lamp) || std::holds_alternative<LedLamp>(lamp);
    lens_radii.push_back(is_round ? lamp_extent(lamp) : 0.0);
    int layer = 0;
    while (layer < static_cast<int>(faces.size()) && faces[layer].z < lamp_position(lamp).z()) ++layer;
    lamp_index.push_back(medium_of(layer).index);
    lamp_in_layer.push_back(layer == field.layer);
  }
}

DirectPacket::DirectPacket(const DirectFrame& frame)
    : frame_(frame),
      field_(frame.fixture.field),
      lamps_(field_.lamp_count()),
      bands_(static_cast<int>(field_.fixture.environment.size())),
      light_(lamps_),
      pass_(field_.pass.empty() ? 0 : static_cast<std::size_t>(kPacket) * lamps_ * bands_) {}

void DirectPacket::look(const RayPacket& rays, DirectCounts& counts) {
  rays_ = &rays;
  frame_.tree.intersect(rays, hits_);
  for (LampLight& one : light_) std::fill_n(one.amount, kPacket, 0.0f);
  for (int lane = 0; lane < kPacket; ++lane) {
    material_[lane] = nullptr;
    if (rays.valid[lane] == 0) continue;
    ++counts.primary;
    if (hits_.object[lane] < 0) continue;
    material_[lane] = &frame_.materials[hits_.object[lane]];
    if (is_lit(material_[lane]->kind)) light_lane(lane);
  }
}

void DirectPacket::light_lane(int lane) {
  float along = 0.0f;
  float length2 = 0.0f;
  float place[3];
  for (int a = 0; a < 3; ++a) {
    place[a] = rays_->origin[a][lane] + hits_.distance[lane] * rays_->direction[a][lane];
    place_[a][lane] = place[a];
    along += hits_.normal[a][lane] * rays_->direction[a][lane];
    length2 += hits_.normal[a][lane] * hits_.normal[a][lane];
  }
  const float scale = (along < 0.0f ? 1.0f : -1.0f) / std::sqrt(std::max(length2, 1e-30f));
  float normal[3];
  for (int a = 0; a < 3; ++a) normal_[a][lane] = normal[a] = scale * hits_.normal[a][lane];
  const float steepness = frame_.shadow_reach.safe_steepness(place[0], place[1], hits_.object[lane]);
  safe_steepness2_[lane] = steepness * steepness;

  const FieldCell cell = find_cell(field_, place[0], place[1], place[2]);
  float flow[4 * kMostDirectLamps];
  look_up_flow(field_, cell, flow);
  for (int lamp = 0; lamp < lamps_; ++lamp) {
    const float* f = flow + 4 * lamp;
    const float amount = -(normal[0] * f[0] + normal[1] * f[1] + normal[2] * f[2]);
    if (!(amount > 0.0f)) continue;
    light_[lamp].amount[lane] = amount;
    for (int a = 0; a < 3; ++a) light_[lamp].towards[a][lane] = -f[a];
  }
  if (pass_.empty()) return;
  const std::size_t width = static_cast<std::size_t>(lamps_) * bands_;
  float* pass = pass_.data() + lane * width;
  std::fill_n(pass, width, 0.0f);
  for (int corner = 0; corner < 8; ++corner) {
    const float* from = field_.pass.data() + cell.node[corner] * width;
    for (std::size_t k = 0; k < width; ++k) pass[k] += cell.weight[corner] * from[k];
  }
}

// The field of a lens point is that of the lens's middle seen from a place set off the other way, since flat layers
// look alike from everywhere; a source that is higher is one that is set off along its own ray.
void DirectPacket::choose_lens_points(int lane, double u, double v) {
  if (material_[lane] == nullptr || !is_lit(material_[lane]->kind)) return;
  for (int lamp = 0; lamp < lamps_; ++lamp) {
    const double radius = frame_.fixture.lens_radii[lamp];
    LampLight& one = light_[lamp];
    if (one.amount[lane] == 0.0f || radius == 0.0) continue;
    const Eigen::Vector2d lens = radius * square_to_disc(u, v);
    const NormalFrame& frame = frame_.fixture.lens_frames[lamp];
    const Eigen::Vector3d offset = lens.x() * frame.x + lens.y() * frame.y;
    const Eigen::Vector3d flows = -Eigen::Vector3d(one.towards[0][lane], one.towards[1][lane], one.towards[2][lane]);
    const Eigen::Vector2d across =
        flows.head<2>() * (field_.index / frame_.fixture.lamp_index[lamp] / flows.norm());  // as the lamp sends it
    const double along2 = 1.0 - across.squaredNorm();
    if (!(along2 > 1e-3)) continue;
    const Eigen::Vector2d shift =
        offset.head<2>() - across * (offset.z() / std::copysign(std::sqrt(along2), flows.z()));
    float flow[4 * kMostDirectLamps];
    look_up_flow(field_,
                 find_cell(field_, place_[0][lane] - static_cast<float>(shift.x()),
                           place_[1][lane] - static_cast<float>(shift.y()), place_[2][lane]),
                 flow);
    const float* turned = flow + 4 * lamp;
    if (!(turned[3] > 0.0f)) continue;
    for (int a = 0; a < 3; ++a) one.towards[a][lane] = -turned[a];
  }
}

void DirectPacket::cast_shadows(DirectCounts& counts) {
  for (int lamp = 0; lamp < lamps_; ++lamp) {
    LampLight& one = light_[lamp];
    bool may_meet[kPacket];
    bool any = false;
    for (int lane = 0; lane < kPacket; ++lane) {
      may_meet[lane] = false;
      if (one.amount[lane] == 0.0f) continue;
      const float x = one.towards[0][lane];
      const float y = one.towards[1][lane];
      const float z = one.towards[2][lane];
      may_meet[lane] = !(z * z >= safe_steepness2_[lane] * (x * x + y * y));
      any = any || may_meet[lane];
      counts.spared += may_meet[lane] ? 0 : 1;
    }
    if (!any) continue;
    any = false;
    for (int lane = 0; lane < kPacket; ++lane) {
      shadow_.valid[lane] = 0;
      shadow_.far[lane] = 0.0f;
      for (int a = 0; a < 3; ++a) {  // Embree aborts at numbers that aren't finite, also in lanes left out
        shadow_.origin[a][lane] = 0.0f;
        shadow_.direction[a][lane] = a == 2 ? 1.0f : 0.0f;
      }
      if (!may_meet[lane]) continue;
      shadow_ray(lane, lamp);
      if (shadow_.far[lane] > 0.0f) {
        shadow_.valid[lane] = -1;
        any = true;
        ++counts.shadow_rays;
      } else {
        ++counts.spared;
      }
    }
    if (!any) continue;
    alignas(64) int free[kPacket];
    frame_.tree.occluded(shadow_, free);
    for (int lane = 0; lane < kPacket; ++lane) {
      if (shadow_.valid[lane] != 0 && free[lane] == 0) one.amount[lane] = 0.0f;
    }
  }
}

void DirectPacket::shadow_ray(int lane, int lamp) {
  const LampLight& one = light_[lamp];
  const Eigen::Vector3f place(place_[0][lane], place_[1][lane], place_[2][lane]);
  const Eigen::Vector3f normal(normal_[0][lane], normal_[1][lane], normal_[2][lane]);
  const Eigen::Vector3f towards =
      Eigen::Vector3f(one.towards[0][lane], one.towards[1][lane], one.towards[2][lane]).normalized();
  // More than single precision loses where the ray meets the surface and where it leaves it.
  const Eigen::Vector3f origin = place + 8e-6f * (1.0f + place.cwiseAbs().maxCoeff()) * normal;
  float far = 1e6f;
  const DirectFixture& fixture = frame_.fixture;
  const double limit = towards.z() > 0.0f ? fixture.high : fixture.low;
  if (std::isfinite(limit) && towards.z() != 0.0f) {
    far = std::max(0.0f, (static_cast<float>(limit) - place.z()) / towards.z());
  }
  if (fixture.lamp_in_layer[lamp]) {
    far = std::min(far, static_cast<float>((lamp_position(field_.fixture.lamps[lamp]) - place.cast<double>()).norm()));
  }
  if (!origin.allFinite() || !towards.allFinite()) return;
  for (int a = 0; a < 3; ++a) {
    shadow_.origin[a][lane] = origin[a];
    shadow_.direction[a][lane] = towards[a];
  }
  shadow_.far[lane] = frame_.shadow_reach.length(origin.x(), origin.y(), origin.z(), towards.x(), towards.y(),
                                                 towards.z(), far, hits_.object[lane]);
}

void DirectPacket::add(int lane, const float* through, float* out) const {
  if (rays_->valid[lane] == 0) return;
  const DirectMaterial* material = material_[lane];
  if (material == nullptr) {
    for (int band = 0; band < bands_; ++band) {
      out[band] += through[band] * static_cast<float>(field_.fixture.environment[band]);
    }
    return;
  }
  if (material->kind == DirectKind::kBlack) return;
  float dimmed[kMaxBands];
  for (int band = 0; band < bands_; ++band) {
    dimmed[band] = through[band];
    if (frame_.fixture.absorbs) dimmed[band] *= std::exp(-frame_.fixture.absorption[band] * hits_.distance[lane]);
  }
  if (material->kind == DirectKind::kLuminous) {
    for (int band = 0; band < bands_; ++band) out[band] += dimmed[band] * material->colour[band];
    return;
  }
  add_reflected(lane, *material, dimmed, out);
}

void DirectPacket::add_reflected(int lane, const DirectMaterial& material, const float* dimmed, float* out) const {
  float sum[kMaxBands] = {};
  for (int lamp = 0; lamp < lamps_; ++lamp) {
    const LampLight& one = light_[lamp];
    const float amount = one.amount[lane];
    if (amount == 0.0f) continue;
    float share[kMaxBands];
    if (material.kind == DirectKind::kMatt) {
      for (int band = 0; band < bands_; ++band) share[band] = material.colour[band] * static_cast<float>(1.0 / kPi);
    } else {
      const Eigen::Vector3d normal(normal_[0][lane], normal_[1][lane], normal_[2][lane]);
      const Eigen::Vector3d back(rays_->direction[0][lane], rays_->direction[1][lane], rays_->direction[2][lane]);
      const Eigen::Vector3d towards(one.towards[0][lane], one.towards[1][lane], one.towards[2][lane]);
      const NormalFrame frame(normal.normalized());
      const Eigen::Vector3d leaving = frame.to_local(-back);
      const Eigen::Vector3d coming = frame.to_local(towards.normalized());
      const double schlick = schlick_weight((leaving + coming).normalized().dot(leaving));
      const double lobe = ggx_reflection(leaving, coming, material.roughness);
      const double missing = material.albedo->missing_ratio(leaving.z());
      for (int band = 0; band < bands_; ++band) {
        const double r = material.colour[band];
        share[band] = static_cast<float>((r + (1.0 - r) * schlick) * (1.0 + r * missing) * lobe);
      }
    }
    const float* pass = pass_.empty() ? nullptr : &pass_[(static_cast<std::size_t>(lane) * lamps_ + lamp) * bands_];
    for (int band = 0; band < bands_; ++band) {
      const float passed = pass == nullptr ? 1.0f : pass[band];
      sum[band] += amount * share[band] * passed * static_cast<float>(field_.intensity[lamp][band]);
    }
  }
  const auto per_index2 = static_cast<float>(1.0 / (field_.index * field_.index));
  for (int band = 0; band < bands_; ++band) out[band] += dimmed[band] * sum[band] * per_index2;
}

}  // namespace touchstone::render
