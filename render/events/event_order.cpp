#include "render/events/event_order.h"

#include <array>
#include <bit>
#include <utility>

namespace touchstone::render {

void sort_by_time(std::vector<Event>& events, std::vector<Event>& spare, std::int64_t begin_us, std::int64_t end_us) {
  if (events.size() < 2) return;
  constexpr int kDigitBits = 11;
  constexpr std::uint64_t kDigits = std::uint64_t{1} << kDigitBits;
  const auto bits = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(end_us - begin_us)));
  spare.resize(events.size());
  std::array<std::size_t, kDigits> next_of;
  for (int shift = 0; shift < bits; shift += kDigitBits) {  // from the lowest digit
    const auto digit = [&](const Event& event) {
      return (static_cast<std::uint64_t>(event.t_us - begin_us) >> shift) & (kDigits - 1);
    };
    next_of.fill(0);
    for (const Event& event : events) ++next_of[digit(event)];
    std::size_t sum = 0;
    for (std::size_t& next : next_of) sum += std::exchange(next, sum);
    for (const Event& event : events) spare[next_of[digit(event)]++] = event;
    std::swap(events, spare);
  }
}

}  // namespace touchstone::render
