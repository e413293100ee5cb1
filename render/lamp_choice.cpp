#include "render/lamp_choice.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace touchstone::render {

void LampChooser::add(const Eigen::Vector3d& position, double power, double index) {
  if (count_ % kLanes == 0) groups_.emplace_back();
  Group& group = groups_.back();
  const int lane = count_++ % kLanes;
  group.x[lane] = static_cast<float>(position.x());
  group.y[lane] = static_cast<float>(position.y());
  group.z[lane] = static_cast<float>(position.z());
  group.power[lane] = static_cast<float>(power);
  group.index[lane] = static_cast<float>(index);
}

LampChoice LampChooser::choose(const Eigen::Vector3d& position, const Eigen::Vector3d* normal, double index,
                               double number) const {
  TS_ASSERT(count_ > 0);
  if (count_ == 1) return {0, 1.0};
  const LampChoice even = {std::min(count_ - 1, static_cast<int>(number * count_)), 1.0 / count_};
  if (count_ > kMostWeighed) return even;

  constexpr float kLeastCosine = 0.05f;
  const Eigen::Array3f p = position.cast<float>();
  std::array<float, kMostWeighed> below;  // the sum of the weights up to and with each lamp's
  float total = 0.0f;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const Group& group = groups_[g];
    const Lanes x = group.x - p.x();
    const Lanes y = group.y - p.y();
    const Lanes z = group.z - p.z();
    const Lanes lateral2 = x * x + y * y;
    const Lanes nearness = 1.0f / (lateral2 + z * z).max(1e-12f);  // 1 / distance^2
    Lanes weights = group.power * nearness;
    if (normal != nullptr) {
      const Eigen::Array3f n = normal->cast<float>();
      const Lanes bend = group.index * (1.0f / static_cast<float>(index));
      const Lanes shrink = bend * nearness.sqrt();
      const Lanes height = (1.0f - bend * bend * lateral2 * nearness).max(0.0f).sqrt();
      const Lanes upright = height * z / z.abs().max(1e-30f);  // with the sense of z
      weights *= ((n.x() * x + n.y() * y) * shrink + n.z() * upright).max(kLeastCosine);
    }
    for (int lane = 0; lane < kLanes; ++lane) below[kLanes * g + lane] = total += weights[lane];
  }
  if (!(total > 0.0f) || !std::isfinite(total)) return even;

  const float at = std::min(static_cast<float>(number), 1.0f - 0x1p-24f) * total;
  int lamp = 0;
  for (int i = 0; i + 1 < count_; ++i) lamp += at >= below[i] ? 1 : 0;
  const auto weight = [&](int i) { return below[i] - (i > 0 ? below[i - 1] : 0.0f); };
  while (lamp > 0 && !(weight(lamp) > 0.0f)) --lamp;  // rounding may have run past the last lamp that shines
  return {lamp, static_cast<double>(weight(lamp)) / static_cast<double>(total)};
}

}  // namespace touchstone::render
