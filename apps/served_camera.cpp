#include "apps/served_camera.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "render/imager/jpeg.h"

namespace touchstone::apps {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostChanges = 1000;  // remembered, for who asks what an earlier frame showed

/// What can still be asked of frames that nobody exposes any more.
std::shared_ptr<const ServedCamera::States> without_light(const ServedCamera::States& states) {
  auto truths = std::make_shared<ServedCamera::States>();
  for (const auto& state : states) {
    auto truth = std::make_shared<lab::CameraState>(*state);
    truth->expose = nullptr;
    truths->push_back(std::move(truth));
  }
  return truths;
}

}  // namespace

ServedCamera::ServedCamera(States states, double rate_Hz, int jpeg_quality)
    : rate_Hz_(rate_Hz), quality_(jpeg_quality), start_(Clock::now()) {
  TS_ASSERT(!states.empty() && rate_Hz > 0.0);
  changes_.push_back({0, std::make_shared<const States>(std::move(states)), std::nullopt});
}

std::int64_t ServedCamera::due() const {
  return static_cast<std::int64_t>(std::chrono::duration<double>(Clock::now() - start_).count() * rate_Hz_);
}

Clock::time_point ServedCamera::time_of(std::int64_t number) const {
  return start_ +
         std::chrono::ceil<Clock::duration>(std::chrono::duration<double>(static_cast<double>(number) / rate_Hz_));
}

std::shared_ptr<const lab::CameraState> ServedCamera::state_at(std::int64_t number) const {
  const auto after = std::upper_bound(changes_.begin(), changes_.end(), number,
                                      [](std::int64_t n, const Change& change) { return n < change.from; });
  if (after == changes_.begin()) return nullptr;
  const Change& change = *(after - 1);
  const auto count = static_cast<std::int64_t>(change.states->size());
  const std::int64_t which = change.held ? *change.held : (number - change.from) % count;
  return (*change.states)[static_cast<std::size_t>(which)];
}

std::shared_ptr<const lab::CameraState> ServedCamera::state_of(std::int64_t number) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return number > due() ? nullptr : state_at(number);
}

void ServedCamera::change(std::shared_ptr<const States> states, std::optional<int> held) {
  const std::int64_t from = due() + 1;
  while (!changes_.empty() && changes_.back().from >= from) changes_.pop_back();
  if (changes_.size() >= kMostChanges) changes_.erase(changes_.begin());
  // The frame that is due is of the last change or, until then, of the one before.
  for (std::size_t i = 0; i + 1 < changes_.size(); ++i) {
    auto& old = changes_[i].states;
    if (old != states && old->front()->expose) old = without_light(*old);
  }
  changes_.push_back({from, std::move(states), held});
}

void ServedCamera::show(States states) {
  TS_ASSERT(!states.empty());
  const std::lock_guard<std::mutex> lock(mutex_);
  change(std::make_shared<const States>(std::move(states)), std::nullopt);
}

void ServedCamera::hold(std::optional<int> state) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto states = changes_.back().states;
  if (state && (*state < 0 || *state >= static_cast<int>(states->size()))) {
    fail("frame {} isn't shown; allowed is 0 to {}", *state, states->size() - 1);
  }
  change(states, state);
}

int ServedCamera::state_count() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return static_cast<int>(changes_.back().states->size());
}

std::shared_ptr<const ServedFrame> ServedCamera::frame(std::int64_t number) {
  const std::lock_guard<std::mutex> making(making_);
  if (made_ && made_->number >= number) return made_;
  auto made = std::make_shared<ServedFrame>();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stopped_) return nullptr;
    made->number = std::max(number, due());  // while others made theirs, an earlier one may have lost its light
    made->state = state_at(made->number);
  }
  made->jpeg = render::jpeg_bytes(made->state->expose(static_cast<std::uint64_t>(made->number)), {.quality = quality_});
  made_ = std::move(made);
  return made_;
}

std::shared_ptr<const ServedFrame> ServedCamera::latest() {
  return frame(due());
}

std::shared_ptr<const ServedFrame> ServedCamera::next(std::int64_t after) {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    stopping_.wait_until(lock, time_of(after + 1), [this] { return stopped_; });
    if (stopped_) return nullptr;
  }
  return frame(std::max(after + 1, due()));
}

void ServedCamera::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
  }
  stopping_.notify_all();
}

}  // namespace touchstone::apps
