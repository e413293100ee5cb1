#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "core/progress.h"

namespace touchstone::apps {

/// Shows on stderr how far long work is, with its rate and the time that is left: a bar on a terminal, a plain line now
/// and then elsewhere, also while work that was begun tells nothing. Work that is done at once shows nothing.
class ProgressBar {
 public:
  /// `quiet`: shows nothing at all
  explicit ProgressBar(bool quiet);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// What long work calls; valid as long as this object lives.
  Progress listener();
  /// How long a stage will take, as far as that is known before it begins: shown as the time left until its steps tell.
  void expect(const std::string& stage, double seconds);

 private:
  using Clock = std::chrono::steady_clock;
  void show(const std::string& stage, std::int64_t done, std::int64_t total);
  void draw(Clock::time_point now);
  void end_stage();
  void keep_drawing();

  bool quiet_;
  bool terminal_;
  std::mutex mutex_;
  std::string stage_;
  std::int64_t done_ = 0;
  std::int64_t first_ = 0;  // had been done when the stage began: samples go on after a unit's set-up
  std::int64_t total_ = 0;
  std::int64_t drawn_ = -1;
  Clock::time_point begun_;
  Clock::time_point last_drawn_;
  bool closed_ = false;
  std::condition_variable closing_;
  std::map<std::string, double> expected_s_;  // by stage
  std::thread clock_;
};

/// "12 s", "3 min 05 s", "2 h 10 min"
std::string duration_text(double seconds);

}  // namespace touchstone::apps
