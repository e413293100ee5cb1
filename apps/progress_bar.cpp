#include "apps/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace touchstone::apps {
namespace {

constexpr double kTerminalInterval_s = 0.1;
constexpr double kPlainInterval_s = 5.0;
constexpr double kSameAgain_s = 60.0;  // until a plain line says that there is nothing new
constexpr int kBarWidth = 24;

double seconds_between(std::chrono::steady_clock::time_point from, std::chrono::steady_clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

std::string duration_text(double seconds) {
  const auto whole = std::lround(std::clamp(seconds, 0.0, 1e9));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

ProgressBar::ProgressBar(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {
  if (!quiet_) clock_ = std::thread([this] { keep_drawing(); });
}

ProgressBar::~ProgressBar() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    closed_ = true;
  }
  closing_.notify_one();
  if (clock_.joinable()) clock_.join();
  end_stage();
}

void ProgressBar::keep_drawing() {
  const std::chrono::duration<double> interval(terminal_ ? 10 * kTerminalInterval_s : kPlainInterval_s);
  std::unique_lock<std::mutex> lock(mutex_);
  while (!closing_.wait_for(lock, interval, [this] { return closed_; })) {
    const Clock::time_point now = Clock::now();
    const bool anew = terminal_ || drawn_ != done_ || seconds_between(last_drawn_, now) >= kSameAgain_s;
    if ((done_ < total_ || total_ == 0) && anew && seconds_between(last_drawn_, now) >= interval.count()) draw(now);
  }
}

Progress ProgressBar::listener() {
  if (quiet_) return {};
  return [this](const std::string& stage, std::int64_t done, std::int64_t total) { show(stage, done, total); };
}

void ProgressBar::expect(const std::string& stage, double seconds) {
  const std::lock_guard<std::mutex> lock(mutex_);
  expected_s_[stage] = seconds;
}

void ProgressBar::show(const std::string& stage, std::int64_t done, std::int64_t total) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Clock::time_point now = Clock::now();
  // A stage may come again, as folds do: threads report out of order, but not by half of all.
  const bool again = total != total_ || (total_ > 0 && done_ >= total_ && 2 * done < total_);
  if (stage != stage_ || again) {
    end_stage();
    stage_ = stage;
    done_ = 0;
    first_ = done;
    begun_ = last_drawn_ = now;
    drawn_ = -1;
  }
  total_ = total;
  done_ = std::max(done_, done);
  if (seconds_between(last_drawn_, now) >= (terminal_ ? kTerminalInterval_s : kPlainInterval_s)) draw(now);
}

void ProgressBar::draw(Clock::time_point now) {
  const double elapsed = seconds_between(begun_, now);
  const double rate = elapsed > 0.0 ? static_cast<double>(done_ - first_) / elapsed : 0.0;
  const double part = total_ > 0 ? static_cast<double>(done_) / static_cast<double>(total_) : 0.0;
  std::string text = total_ > 0 ? fmt::format("{}/{}", done_, total_) : fmt::format("{}", done_);
  if (rate > 0.0) text += fmt::format("  {:.3g}/s", rate);
  const auto expected = expected_s_.find(stage_);
  if (done_ < total_ && rate == 0.0 && expected != expected_s_.end()) {
    text += fmt::format("  about {} left", duration_text(std::max(0.0, expected->second - elapsed)));
  } else if (done_ >= total_ || rate == 0.0) {  // so where no end is known, too
    text += "  in " + duration_text(elapsed);
  } else {
    text += "  " + duration_text(static_cast<double>(total_ - done_) / rate) + " left";
  }
  if (total_ == 0 && terminal_) {
    fmt::print(stderr, "\r\x1b[K{:<10} {}", stage_, text);
  } else if (total_ == 0) {
    fmt::print(stderr, "{}: {}\n", stage_, text);
  } else if (terminal_) {
    const int full = std::clamp(static_cast<int>(part * kBarWidth), 0, kBarWidth);
    const std::string bar = std::string(full, '#') + std::string(kBarWidth - full, '.');
    fmt::print(stderr, "\r\x1b[K{:<10} [{}] {:3.0f} %  {}", stage_, bar, 100.0 * part, text);
  } else {
    fmt::print(stderr, "{}: {:.0f} %  {}\n", stage_, 100.0 * part, text);
  }
  std::fflush(stderr);
  last_drawn_ = now;
  drawn_ = done_;
}

void ProgressBar::end_stage() {
  if (drawn_ < 0) return;  // too short to have been shown
  if (drawn_ != done_) draw(Clock::now());
  if (terminal_) fmt::print(stderr, "\n");
  drawn_ = -1;
}

}  // namespace touchstone::apps
