#pragma once
// Sixteen rays at a time against opaque surfaces and balls that move from frame to frame.

#include <memory>

#include "render/scene/scene.h"

namespace touchstone::render {

inline constexpr int kPacket = 16;  ///< rays of a packet

/// Rays of lanes whose `valid` is -1; 0 leaves a lane out. All lanes must hold finite numbers (Embree aborts else).
struct alignas(64) RayPacket {
  float origin[3][kPacket];
  float direction[3][kPacket];  ///< unit
  float far[kPacket];           ///< mm
  int valid[kPacket];
};

/// What sixteen rays have met, ray by ray; where one meets nothing, only its `object` counts.
struct alignas(64) PacketHits {
  float distance[kPacket];
  float normal[3][kPacket];      ///< not of unit length, in the surface's own sense
  float shading[3][kPacket];     ///< the shading normal, see Surface; as `normal` where there is no other
  float lift[3][kPacket];        ///< as RayHit::lift
  int object[kPacket];           ///< index of the surface, or surfaces.size() + index of the ball; -1 for nothing
  int triangle[kPacket];         ///< of the surface; -1 on a ball
  float u[kPacket], v[kPacket];  ///< on a triangle a b c the place is (1 - u - v) a + u b + v c
};

/// The tree is built once by one thread, and a scene of the same triangles at other places only fits its boxes anew:
/// the same hits for any number of threads, whatever was drawn between.
class PacketScene {
 public:
  /// Films stop no ray: they aren't in the tree. @pre check_scene(scene) holds; no Refractive materials
  explicit PacketScene(const Scene& scene);
  ~PacketScene();
  PacketScene(PacketScene&&) noexcept;

  /// Moves vertices and balls to where `scene` has them. False, and nothing done, where its triangles or the number of
  /// its balls are others.
  bool move_to(const Scene& scene);

  /// The nearest hit of each valid ray.
  void intersect(const RayPacket& rays, PacketHits& hits) const;

  /// Sets valid lanes of `rays` that meet something within `far` to 0 in `free`, the other valid ones to -1.
  void occluded(const RayPacket& rays, int* free) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace touchstone::render
