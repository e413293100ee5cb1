#pragma once
// Do events keep time with lamps on the mains, whose light swings at 100 Hz or 120 Hz? Such events are accumulated with
// those of a touch, and a force that is estimated from the counts may be anything.
//
// At each of the two frequencies the phases of N events are added, ON and OFF with opposite signs, as flicker has ON
// where it has no OFF: z = |sum of +-exp(i 2 pi f t)|^2 / N. Of events at random times z is exponentially distributed
// with mean 1 (Rayleigh's test [Mardia2000, sec. 6.3]); of flicker it grows with N. The mains keep their frequency to a
// few tenths of a hertz only, so sums end after a quarter of a second, and the blocks' z are added: gamma distributed.

#include <array>
#include <complex>
#include <cstdint>
#include <span>

#include "core/frame.h"

namespace touchstone::sensors {

/// What the events so far say.
struct MainsFlicker {
  double frequency_Hz = 0.0;  ///< 100 or 120: which of the two they keep time with better; 0 without events
  double share = 0.0;         ///< mean length of the blocks' sums over their number of events: 0 to 1
  double chance = 1.0;        ///< that events at random times keep time so well
  std::int64_t events = 0;

  /// Whether it is flicker: at least a tenth keeps time, and by chance that would be once in 10^9 times.
  bool found() const { return share >= 0.1 && chance < 1e-9; }
};

/// Takes the events of a scene at rest, as before a touch, in portions of any size. A vibration at these frequencies
/// looks the same, and spoils counts alike.
class MainsFlickerMeter {
 public:
  /// @throws Error naming the event (its number since the beginning) whose time goes backwards; those before it count
  void add(std::span<const Event> events);
  MainsFlicker flicker() const;  ///< what the events so far say

 private:
  static constexpr std::array<double, 2> kFrequencies_Hz = {100.0, 120.0};
  struct Sums {
    double z = 0.0;       ///< of whole blocks
    double length = 0.0;  ///< likewise
    std::complex<double> open;
  };
  static void close(Sums& sums, std::int64_t events);

  std::array<Sums, kFrequencies_Hz.size()> sums_;
  std::int64_t events_ = 0, open_events_ = 0;
  std::int64_t block_us_ = 0, last_us_ = 0;
  int blocks_ = 0;  // whole ones
};

}  // namespace touchstone::sensors
