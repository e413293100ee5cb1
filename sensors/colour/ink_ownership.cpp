#include "sensors/colour/ink_ownership.h"

#include <algorithm>
#include <numeric>

#include "core/error.h"

namespace touchstone::sensors {

namespace {

constexpr double kWholePatch = 0.35;    ///< of the usual area: what is smaller is a piece of a marker
constexpr double kMergedPatches = 1.8;  ///< of the usual area: two markers' ink has run together; one is stretched
                                        ///< to it by a third along both sides
constexpr double kBarelyUnder = 0.2;    ///< of a patch's area
constexpr double kLargestStep = 0.3;    ///< spacings, between sound neighbours

}  // namespace

InkOwners own_ink(const std::vector<InkPatch>& patches, std::size_t markers, const InkRules& rules) {
  InkOwners owners;
  owners.owner.assign(patches.size(), -1);
  owners.flaws.assign(markers, MarkerFlaw::kMissing);
  std::vector<int> whole_patches(markers, 0);
  const auto flaw = [&](std::size_t marker, MarkerFlaw what) {
    MarkerFlaw& current = owners.flaws[marker];
    // Two filters outweigh all: the patch may be another marker's.
    if (current != MarkerFlaw::kTwoFilters) current = what;
  };
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const InkPatch& patch = patches[p];
    TS_ASSERT(patch.under.size() == markers);
    const bool whole = patch.area_px >= kWholePatch * rules.usual_area_px;
    const auto most = std::max_element(patch.under.begin(), patch.under.end());
    if (whole && (markers == 0 || *most < kBarelyUnder * patch.area_px)) ++owners.stray;
    if (markers == 0 || *most == 0) continue;
    const auto own = static_cast<std::size_t>(most - patch.under.begin());
    owners.owner[p] = static_cast<int>(own);
    if (patch.at_border) {
      flaw(own, MarkerFlaw::kCutOff);
    } else if (owners.flaws[own] == MarkerFlaw::kMissing) {
      flaw(own, MarkerFlaw::kNone);
    }
    const int foreign = std::accumulate(patch.under.begin(), patch.under.end(), 0) - *most;
    const bool merged = patch.area_px > kMergedPatches * rules.usual_area_px;
    const double allowed = merged ? 0.0 : rules.most_under_neighbour * patch.area_px;
    if (merged || foreign > allowed) flaw(own, MarkerFlaw::kTwoFilters);
    for (std::size_t i = 0; i < markers; ++i) {
      if (i != own && patch.under[i] > allowed) flaw(i, MarkerFlaw::kTwoFilters);
    }
    if (whole && ++whole_patches[own] > 1) flaw(own, MarkerFlaw::kTwoFilters);
  }
  return owners;
}

void doubt_enclosed(const Eigen::Vector2i& grid, const std::vector<Eigen::Vector2d>& shift,
                    const std::vector<std::uint8_t>& missing_at_rest, std::vector<MarkerFlaw>& flaws) {
  const auto count = static_cast<std::size_t>(grid.x()) * static_cast<std::size_t>(grid.y());
  TS_ASSERT(shift.size() == count && missing_at_rest.size() == count && flaws.size() == count);
  bool doubt = false;
  for (std::size_t i = 0; i < count; ++i) {
    doubt = doubt || flaws[i] == MarkerFlaw::kTwoFilters || (flaws[i] == MarkerFlaw::kMissing && !missing_at_rest[i]);
  }
  if (!doubt) return;
  std::vector<std::uint8_t> joined(count, 0);
  std::vector<Eigen::Vector2i> open;
  const auto index = [&](const Eigen::Vector2i& at) { return static_cast<std::size_t>(at.y() * grid.x() + at.x()); };
  for (int y = 0; y < grid.y(); ++y) {
    for (int x = 0; x < grid.x(); ++x) {
      const bool at_rim = x == 0 || y == 0 || x == grid.x() - 1 || y == grid.y() - 1;
      const std::size_t i = index({x, y});
      if (!at_rim || flaws[i] != MarkerFlaw::kNone) continue;
      joined[i] = 1;
      open.emplace_back(x, y);
    }
  }
  while (!open.empty()) {
    const Eigen::Vector2i from = open.back();
    open.pop_back();
    for (const Eigen::Vector2i& step :
         {Eigen::Vector2i(1, 0), Eigen::Vector2i(-1, 0), Eigen::Vector2i(0, 1), Eigen::Vector2i(0, -1)}) {
      const Eigen::Vector2i to = from + step;
      if ((to.array() < 0).any() || (to.array() >= grid.array()).any()) continue;
      const std::size_t i = index(to);
      if (joined[i] || flaws[i] != MarkerFlaw::kNone) continue;
      if ((shift[i] - shift[index(from)]).norm() > kLargestStep) continue;
      joined[i] = 1;
      open.push_back(to);
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (flaws[i] == MarkerFlaw::kNone && !joined[i]) flaws[i] = MarkerFlaw::kTwoFilters;
  }
}

}  // namespace touchstone::sensors
