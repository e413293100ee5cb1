#include "render/direct/direct_batch.h"

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>

#include "core/error.h"

namespace touchstone::render {
namespace {

constexpr float kOnFace = 1e-3f;  // mm: films may lie on the face where camera rays enter the layer
constexpr auto kPerPi = static_cast<float>(1.0 / kPi);

}  // namespace

DirectBatch::DirectBatch(const DirectFrame& frame)
    : frame_(frame),
      fixture_(frame.fixture),
      field_(fixture_.field),
      lamps_(field_.beam_count()),
      bands_(static_cast<int>(field_.fixture.environment.size())),
      stride_(static_cast<std::size_t>(fixture_.groups) * 4),
      lanes_(kMostPackets * kPacket),
      amounts_(lanes_.size() * stride_),
      flows_(lanes_.size() * stride_ * 3),
      directions_(frame.shadow_reach != nullptr ? flows_.size() : 0),
      pass_(field_.pass.empty() ? 0 : lanes_.size() * stride_ * bands_),
      shares_(frame.horizons != nullptr ? static_cast<std::size_t>(lamps_) * kPacket : 0) {}

void DirectBatch::intersect(std::span<const RayPacket> rays, DirectCounts& counts) {
  TS_ASSERT(rays.size() <= kMostPackets);
  rays_ = rays;
  PacketHits hits;
  for (std::size_t number = 0; number < rays.size(); ++number) {
    const RayPacket& packet = rays[number];
    frame_.tree.intersect(packet, hits);
    if (frame_.sheet != nullptr) meet_sheet(packet, hits);
    for (int k = 0; k < kPacket; ++k) {
      const int lane = static_cast<int>(number) * kPacket + k;
      Lane& one = lanes_[lane];
      one.material = nullptr;
      one.doubt = 0;
      // A point set in which rows, columns and quarters of the square are shared out evenly over the packet (the first
      // sixteen of van der Corput's, paired with their own number), laid so that lanes beside each other differ.
      constexpr int kOrder[kPacket] = {0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};
      const int number_in_set = kOrder[k];
      const int reversed =
          (number_in_set & 1) << 3 | (number_in_set & 2) << 1 | (number_in_set & 4) >> 1 | number_in_set >> 3;
      one.spread[0] = (static_cast<float>(number_in_set) + 0.5f) / kPacket - 0.5f;
      one.spread[1] = (static_cast<float>(reversed) + 0.5f) / kPacket - 0.5f;
      if (packet.valid[k] == 0) continue;
      ++counts.primary;
      one.object = hits.object[k];
      one.film = film_before(packet, k, one.object < 0 ? packet.far[k] : hits.distance[k]);
      if (one.object < 0) continue;
      one.material = &frame_.materials[one.object];
      one.colour = one.material->colour.data();
      if (one.material->print != nullptr) {
        one.colour = one.material->print->colour_at(hits.triangle[k], hits.u[k], hits.v[k], one.colour);
      }
      one.distance = hits.distance[k];
      one.triangle = hits.triangle[k];
      one.u = hits.u[k];
      one.v = hits.v[k];
      float along = 0.0f;
      float shading_along = 0.0f;
      for (int a = 0; a < 3; ++a) {
        one.place[a] = packet.origin[a][k] + one.distance * packet.direction[a][k];
        along += hits.normal[a][k] * packet.direction[a][k];
        shading_along += hits.shading[a][k] * packet.direction[a][k];
      }
      // A smooth normal that has turned away from the camera is left for the triangle's own.
      const bool turned_away = (along < 0.0f) != (shading_along < 0.0f);
      const auto& normal = turned_away ? hits.normal : hits.shading;
      float length2 = 0.0f;
      for (int a = 0; a < 3; ++a) length2 += normal[a][k] * normal[a][k];
      const float scale = (along < 0.0f ? 1.0f : -1.0f) / std::sqrt(std::max(length2, 1e-30f));
      float furthest = 0.0f;
      for (int a = 0; a < 3; ++a) {
        one.normal[a] = scale * normal[a][k];
        furthest = std::max(furthest, std::abs(one.place[a]));
      }
      // More than single precision loses where the ray meets the surface and where it leaves it.
      const float off = 8e-6f * (1.0f + furthest);
      for (int a = 0; a < 3; ++a) one.leave[a] = one.place[a] + hits.lift[a][k] + off * one.normal[a];
      if (is_lit(one.material->kind)) light_lane(lane, counts);
    }
    if (frame_.horizons != nullptr) dim_by_horizons(static_cast<int>(number));
  }
}

/// Where rays meet the first surface before anything else. No shadow ray will start there, so nothing is lifted.
void DirectBatch::meet_sheet(const RayPacket& packet, PacketHits& hits) const {
  for (int k = 0; k < kPacket; ++k) {
    if (packet.valid[k] == 0) continue;
    const Eigen::Vector3d origin(packet.origin[0][k], packet.origin[1][k], packet.origin[2][k]);
    const Eigen::Vector3d direction(packet.direction[0][k], packet.direction[1][k], packet.direction[2][k]);
    const double far = hits.object[k] < 0 ? packet.far[k] : hits.distance[k];
    const auto hit = frame_.sheet->first(origin, direction, far);
    if (!hit) continue;
    const SheetNormals normals = normals_at(frame_.sheet->surface(), *hit);
    hits.object[k] = 0;
    hits.triangle[k] = hit->triangle;
    hits.u[k] = static_cast<float>(hit->u);
    hits.v[k] = static_cast<float>(hit->v);
    hits.distance[k] = static_cast<float>(hit->distance);
    for (int axis = 0; axis < 3; ++axis) {
      hits.normal[axis][k] = static_cast<float>(normals.face[axis]);
      hits.shading[axis][k] = static_cast<float>(normals.shading[axis]);
      hits.lift[axis][k] = 0.0f;
    }
  }
}

/// The share of a camera ray that meets film within the given distance.
float DirectBatch::film_before(const RayPacket& packet, int slot, float distance) const {
  const FilmScreen& films = fixture_.films;
  if (films.empty()) return 0.0f;
  const float to_films = (films.z() - packet.origin[2][slot]) / packet.direction[2][slot];
  if (!(to_films >= -kOnFace && to_films < distance)) return 0.0f;
  return films.camera_cover(packet.origin[0][slot] + to_films * packet.direction[0][slot],
                            packet.origin[1][slot] + to_films * packet.direction[1][slot]);
}

void DirectBatch::light_lane(int lane, DirectCounts& counts) {
  Lane& one = lanes_[lane];
  const FieldCell cell = find_cell(field_, one.place[0], one.place[1], one.place[2]);
  float* amount = amounts(lane);
  float* flow = flows_.data() + static_cast<std::size_t>(lane) * stride_ * 3;
  const std::size_t width = stride_ * 3;
  for (int group = 0; group < fixture_.groups; ++group) {
    Four x = Four::Zero();
    Four y = Four::Zero();
    Four z = Four::Zero();
    for (int corner = 0; corner < 8; ++corner) {
      const float* from = fixture_.flow.data() + static_cast<std::size_t>(cell.node[corner]) * width + group * 12;
      x += cell.weight[corner] * four(from);
      y += cell.weight[corner] * four(from + 4);
      z += cell.weight[corner] * four(from + 8);
    }
    Eigen::Map<Four>(flow + group * 12) = x;
    Eigen::Map<Four>(flow + group * 12 + 4) = y;
    Eigen::Map<Four>(flow + group * 12 + 8) = z;
    Eigen::Map<Four>(amount + group * 4) = (-(one.normal[0] * x + one.normal[1] * y + one.normal[2] * z)).max(0.0f);
  }
  if (frame_.shadow_reach != nullptr) {
    one.doubt = frame_.shadow_reach->doubtful(one.place[0], one.place[1], one.object);
  }
  std::uint64_t lit = 0;
  for (int lamp = 0; lamp < lamps_; ++lamp) lit |= std::uint64_t{amount[lamp] > 0.0f} << lamp;
  one.doubt &= lit;
  counts.spared += std::popcount(lit ^ one.doubt);
  if (one.doubt != 0) {
    float* direction = directions_.data() + static_cast<std::size_t>(lane) * stride_ * 3;
    for (int group = 0; group < fixture_.groups; ++group) {
      const Four x = four(flow + group * 12);
      const Four y = four(flow + group * 12 + 4);
      const Four z = four(flow + group * 12 + 8);
      const Four scale = -(x * x + y * y + z * z).max(1e-30f).sqrt().inverse();
      Eigen::Map<Four>(direction + group * 12) = scale * x;
      Eigen::Map<Four>(direction + group * 12 + 4) = scale * y;
      Eigen::Map<Four>(direction + group * 12 + 8) = scale * z;
    }
  }
  if (pass_.empty()) return;
  const std::size_t pass_width = stride_ * bands_;
  float* pass = pass_.data() + lane * pass_width;
  std::fill_n(pass, pass_width, 0.0f);
  for (int corner = 0; corner < 8; ++corner) {
    const float* from = fixture_.pass.data() + cell.node[corner] * pass_width;
    for (std::size_t k = 0; k < pass_width; ++k) pass[k] += cell.weight[corner] * from[k];
  }
}

Eigen::Array4f DirectBatch::passing(int lane, int group, int band) const {
  if (pass_.empty()) return Four::Ones();
  return four(pass_.data() + (static_cast<std::size_t>(lane) * bands_ + band) * stride_ + group * 4);
}

Eigen::Vector3f DirectBatch::flow_of(int lane, int lamp) const {
  const float* from = flows_.data() + static_cast<std::size_t>(lane) * stride_ * 3 + lamp / 4 * 12 + lamp % 4;
  return {from[0], from[4], from[8]};
}

void DirectBatch::add(int lane, const float* through, const float* ambient, float* out) const {
  if (packet_of(lane).valid[lane % kPacket] == 0) return;
  const Lane& one = lanes_[lane];
  if (one.material != nullptr && one.material->kind == DirectKind::kBlack) return;
  float dimmed[kMaxBands];
  std::copy_n(through, bands_, dimmed);
  if (one.film > 0.0f) {
    FilmScreen::Light one_ray;
    fixture_.films.add(1.0f, one.film, std::abs(packet_of(lane).direction[2][lane % kPacket]), one_ray);
    float left[kMaxBands];
    fixture_.films.pass(one_ray, left);
    for (int band = 0; band < bands_; ++band) dimmed[band] *= left[band];
  }
  if (one.material == nullptr) {
    for (int band = 0; band < bands_; ++band) {
      out[band] += dimmed[band] * static_cast<float>(field_.fixture.environment[band]);
    }
    return;
  }
  if (fixture_.absorbs) {
    for (int band = 0; band < bands_; ++band) dimmed[band] *= std::exp(-fixture_.absorption[band] * one.distance);
  }
  if (one.material->kind == DirectKind::kLuminous) {
    for (int band = 0; band < bands_; ++band) out[band] += dimmed[band] * one.material->colour[band];
    return;
  }
  float sum[kMaxBands] = {};
  if (!fixture_.films.empty()) {
    reflect_through_films(lane, sum);
  } else if (one.material->kind == DirectKind::kMatt) {
    reflect_from_matt(lane, sum);
  } else {
    reflect_from_metal(lane, sum);
  }
  const auto per_index2 = static_cast<float>(1.0 / (field_.index * field_.index));
  for (int band = 0; band < bands_; ++band) {
    if (ambient != nullptr) sum[band] += one.colour[band] * kPerPi * ambient[band];
    out[band] += dimmed[band] * sum[band] * per_index2;
  }
}

std::optional<DirectBatch::SheetPlace> DirectBatch::sheet_place(int lane) const {
  const Lane& one = lanes_[lane];
  if (packet_of(lane).valid[lane % kPacket] == 0 || one.material == nullptr) return std::nullopt;
  if (one.object != 0 || one.material->kind != DirectKind::kMatt) return std::nullopt;
  return SheetPlace{one.place, one.normal, one.triangle, one.u, one.v};
}

void DirectBatch::white_light(int lane, const float* ambient, float* out) const {
  const Lane& one = lanes_[lane];
  const Eigen::Vector3f normal(one.normal);
  const auto per_index2 = static_cast<float>(1.0 / (field_.index * field_.index));
  for (int band = 0; band < bands_; ++band) {
    Eigen::Vector3f flow = Eigen::Vector3f::Zero();
    for (int lamp = 0; lamp < lamps_; ++lamp) {
      const float amount = amounts(lane)[lamp];
      if (!(amount > 0.0f)) continue;
      const Eigen::Vector3f from = flow_of(lane, lamp);
      // What of it gets through to the place: less what stands in its way.
      const float through = amount / std::max(-normal.dot(from), 1e-30f);
      const float intensity = fixture_.intensity[static_cast<std::size_t>(band) * stride_ + lamp];
      const float passing =
          pass_.empty() ? 1.0f : pass_[(static_cast<std::size_t>(lane) * bands_ + band) * stride_ + lamp];
      flow -= std::min(through, 1.0f) * intensity * passing * from;
    }
    float scale = kPerPi * per_index2;
    if (fixture_.absorbs) scale *= std::exp(-fixture_.absorption[band] * one.distance);
    for (int axis = 0; axis < 3; ++axis) out[4 * band + axis] = scale * flow[axis];
    out[4 * band + 3] = ambient == nullptr ? 0.0f : scale * ambient[band];
  }
}

float DirectBatch::irradiance(int lane, int band) const {
  const float* amount = amounts(lane);
  const float* intensity = fixture_.intensity.data() + band * stride_;
  Four lit = Four::Zero();
  for (int group = 0; group < fixture_.groups; ++group) {
    lit += four(amount + group * 4) * four(intensity + group * 4) * passing(lane, group, band);
  }
  return lit.sum();
}

void DirectBatch::sent_back(int lane, const float* ambient, float* out) const {
  for (int band = 0; band < bands_; ++band) {
    const float arriving = irradiance(lane, band) + (ambient == nullptr ? 0.0f : ambient[band]);
    out[band] = lanes_[lane].material->colour[band] * arriving;
  }
}

void DirectBatch::reflect_from_matt(int lane, float* sum) const {
  for (int band = 0; band < bands_; ++band) sum[band] = lanes_[lane].colour[band] * kPerPi * irradiance(lane, band);
}

/// As from a matt surface, less what films keep where each lamp's ray crosses their plane. Lamps of one colour are
/// added up first, those parts that meet film by their slope: the bands are many, and film takes of each another share.
void DirectBatch::reflect_through_films(int lane, float* sum) const {
  const Lane& one = lanes_[lane];
  const FilmScreen& films = fixture_.films;
  const float* amount = amounts(lane);
  const float height = films.z() - one.place[2];
  FilmScreen::Light light;
  for (std::size_t colour = 0; colour < fixture_.colour_lamp.size(); ++colour) {
    light = {};
    for (int lamp = 0; lamp < lamps_; ++lamp) {
      if (amount[lamp] == 0.0f || fixture_.colour_of[lamp] != static_cast<int>(colour)) continue;
      const Eigen::Vector3f flow = flow_of(lane, lamp);
      const float to_films = height / -flow.z();
      const bool before_films = fixture_.lamp_in_layer[lamp] &&
                                (lamp_position(field_.lamp(lamp)).z() - double(films.z())) * double(-height) > 0.0;
      if (before_films || !(to_films > 0.0f)) {
        light.plain += amount[lamp];
        continue;
      }
      const float cover = films.lamp_cover(one.place[0] - to_films * flow.x(), one.place[1] - to_films * flow.y());
      films.add(amount[lamp], cover, std::abs(flow.z()) / flow.norm(), light);
    }
    float left[kMaxBands];
    films.pass(light, left);
    const int lamp = fixture_.colour_lamp[colour];
    for (int band = 0; band < bands_; ++band) {
      sum[band] += one.colour[band] * kPerPi * left[band] * fixture_.intensity[band * stride_ + lamp];
    }
  }
}

/// ggx.h's formulas, four lamps at a time; each lamp is one direction.
void DirectBatch::reflect_from_metal(int lane, float* sum) const {
  const Lane& one = lanes_[lane];
  const DirectMaterial& material = *one.material;
  const RayPacket& packet = packet_of(lane);
  const Eigen::Array3f back(-packet.direction[0][lane % kPacket], -packet.direction[1][lane % kPacket],
                            -packet.direction[2][lane % kPacket]);
  const Eigen::Array3f normal(one.normal[0], one.normal[1], one.normal[2]);
  const float out = (normal * back).sum();
  if (!(out > 0.0f)) return;
  const auto missing = static_cast<float>(material.albedo->missing_ratio(double(out)));
  const auto a2 = static_cast<float>(material.roughness * material.roughness);
  const float slope_out = std::sqrt(a2 + (1.0f - a2) * out * out);
  const float* flow = flows_.data() + static_cast<std::size_t>(lane) * stride_ * 3;
  for (int group = 0; group < fixture_.groups; ++group) {
    const Four amount = four(amounts(lane) + group * 4);
    if ((amount == 0.0f).all()) continue;
    const Four x = four(flow + group * 12);
    const Four y = four(flow + group * 12 + 4);
    const Four z = four(flow + group * 12 + 8);
    const Four per_length = -(x * x + y * y + z * z).max(1e-30f).rsqrt();
    const Four in = ((x * normal[0] + y * normal[1] + z * normal[2]) * per_length).max(0.0f);
    // The facet's normal that mirrors one into the other; its sine by the cross product, since for a smooth metal
    // 1 - cos^2 would have no digits left.
    Four hx = x * per_length + back[0];
    Four hy = y * per_length + back[1];
    Four hz = z * per_length + back[2];
    const Four per_half = (hx * hx + hy * hy + hz * hz).max(1e-30f).rsqrt();
    hx *= per_half;
    hy *= per_half;
    hz *= per_half;
    const Four sine2 = (normal[1] * hz - normal[2] * hy).square() + (normal[2] * hx - normal[0] * hz).square() +
                       (normal[0] * hy - normal[1] * hx).square();
    const Four spread = a2 + (1.0f - a2) * sine2;
    const Four masking = out * (a2 + (1.0f - a2) * in * in).sqrt() + in * slope_out;
    const Four lobe = a2 * kPerPi / (spread * spread) * 0.5f / masking.max(1e-30f);
    const Four graze = (1.0f - (hx * back[0] + hy * back[1] + hz * back[2])).max(0.0f).min(1.0f);
    const Four schlick = graze.square().square() * graze;
    const Four arriving = amount * lobe;
    for (int band = 0; band < bands_; ++band) {
      const float r = one.colour[band];
      const Four intensity = four(fixture_.intensity.data() + band * stride_ + group * 4);
      const Four share = (r + (1.0f - r) * schlick) * (1.0f + r * missing);
      sum[band] += (arriving * share * intensity * passing(lane, group, band)).sum();
    }
  }
}

}  // namespace touchstone::render
