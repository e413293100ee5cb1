#pragma once
// A camera's rays, batch by batch.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <vector>

#include "render/direct/direct_batch.h"

namespace touchstone::render {

/// work(lane, row, column) of the packets' lanes that lie on the grid.
template <typename Work>
void for_lanes_on_grid(const CameraRays& rays, int first_tile, int packets, const Work& work) {
  for (int lane = 0; lane < packets * kPacket; ++lane) {
    const int tile = first_tile + lane / kPacket;
    const int row = tile / rays.tiles_across * CameraRays::kSide + lane % kPacket / CameraRays::kSide;
    const int column = tile % rays.tiles_across * CameraRays::kSide + lane % CameraRays::kSide;
    if (column < rays.grid.columns && row < rays.grid.rows) work(lane, row, column);
  }
}

/// work(batch, first tile, packets, counts) for all tiles of the rays, by many threads. What each task counted.
template <typename Work>
std::vector<DirectCounts> for_batches(const CameraRays& rays, const DirectFrame& frame, const Work& work) {
  constexpr int kTilesATask = 2 * DirectBatch::kMostPackets;
  const int tasks = (rays.tiles + kTilesATask - 1) / kTilesATask;
  std::vector<DirectCounts> counts(tasks);
  tbb::parallel_for(0, tasks, [&](int task) {
    DirectBatch batch(frame);
    const int end = std::min(rays.tiles, (task + 1) * kTilesATask);
    for (int first = task * kTilesATask; first < end; first += DirectBatch::kMostPackets) {
      work(batch, first, std::min(DirectBatch::kMostPackets, end - first), counts[task]);
    }
  });
  return counts;
}

}  // namespace touchstone::render
