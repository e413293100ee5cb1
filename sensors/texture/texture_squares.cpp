#include "sensors/texture/texture_squares.h"

#include <algorithm>
#include <map>

#include "core/error.h"

namespace touchstone::sensors {

std::vector<cv::Mat> squares_of(const cv::Mat& heights_mm, int side_px) {
  if (side_px < 1) fail("squares of {} px a side: at least 1 is needed", side_px);
  const int columns = heights_mm.cols / side_px, rows = heights_mm.rows / side_px;
  if (columns < 1 || rows < 1) {
    fail("a height map of {} x {} px doesn't hold a square of {} px a side", heights_mm.cols, heights_mm.rows, side_px);
  }
  const int left = (heights_mm.cols - columns * side_px) / 2, top = (heights_mm.rows - rows * side_px) / 2;
  std::vector<cv::Mat> squares;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      squares.push_back(heights_mm(cv::Rect(left + i * side_px, top + j * side_px, side_px, side_px)));
    }
  }
  return squares;
}

TextureVote vote(std::span<const TextureMatch> matches) {
  if (matches.empty()) fail("texture: no square has voted");
  struct Party {
    int squares = 0;
    double nearest = 2.0, sum = 0.0;
  };
  std::map<int, Party> parties;
  for (const TextureMatch& match : matches) {
    Party& party = parties[match.label];
    ++party.squares;
    party.nearest = std::min(party.nearest, match.distance);
    party.sum += match.distance;
  }
  const auto winner = std::ranges::max_element(parties, [](const auto& a, const auto& b) {
    if (a.second.squares != b.second.squares) return a.second.squares < b.second.squares;
    return a.second.nearest > b.second.nearest;
  });
  return {.label = winner->first,
          .squares = static_cast<int>(matches.size()),
          .agreeing = winner->second.squares,
          .distance = winner->second.sum / winner->second.squares};
}

}  // namespace touchstone::sensors
