// Events a second that are written to and read from files of each format, on one thread: a camera of 346 x 260 pixels
// in bursts (rows of neighbours, an EVT 3.0 vector's case) and one by one (each event a time and a place of its own).
//   build/dev/bench/bench_event_files

#include <benchmark/benchmark.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sensors/events/event_file.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sensors {
namespace {

constexpr int kWidth = 346;
constexpr int kHeight = 260;
constexpr int kEvents = 2'000'000;
constexpr std::array kEndings{".txt", ".h5", ".raw", ".aedat4"};

std::vector<Event> make_events(bool bursts) {
  std::uint64_t state = 1;
  const auto below = [&](std::uint64_t n) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (state >> 33) % n;
  };
  std::vector<Event> events;
  std::int64_t t_us = 0;
  while (static_cast<int>(events.size()) < kEvents) {
    t_us += static_cast<std::int64_t>(1 + below(3));
    const auto y = static_cast<std::uint16_t>(below(kHeight));
    const std::uint64_t first = below(kWidth);
    const bool on = below(2) == 0;
    const std::uint64_t end = std::min<std::uint64_t>(kWidth, first + (bursts ? 1 + below(24) : 1));
    for (std::uint64_t x = first; x < end; ++x) events.push_back({t_us, static_cast<std::uint16_t>(x), y, on});
  }
  return events;
}

const std::vector<Event>& events_of(bool bursts) {
  static const std::vector<Event> lone = make_events(false);
  static const std::vector<Event> together = make_events(true);
  return bursts ? together : lone;
}

std::filesystem::path file_of(const benchmark::State& state) {
  static const test::TemporaryFolder folder;
  return folder.path() / (std::string("events") + kEndings[static_cast<std::size_t>(state.range(0))]);
}

void write_file(const std::filesystem::path& file, const std::vector<Event>& events) {
  EventWriter writer(file, {kWidth, kHeight}, "bench");
  writer.append(events);
  writer.close();
}

void finish(benchmark::State& state, const std::filesystem::path& file, std::size_t events) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(events));
  state.counters["bytes/event"] = static_cast<double>(std::filesystem::file_size(file)) / static_cast<double>(events);
  state.SetLabel(std::string(kEndings[static_cast<std::size_t>(state.range(0))]) +
                 (state.range(1) != 0 ? " bursts" : " one by one"));
  std::filesystem::remove(file);
}

void write_events(benchmark::State& state) {
  const std::vector<Event>& events = events_of(state.range(1) != 0);
  const std::filesystem::path file = file_of(state);
  for (auto _ : state) write_file(file, events);
  finish(state, file, events.size());
}

void read_portions(benchmark::State& state) {
  const std::vector<Event>& events = events_of(state.range(1) != 0);
  const std::filesystem::path file = file_of(state);
  write_file(file, events);
  for (auto _ : state) {
    EventReader reader(file);
    std::int64_t sum = 0;
    for (auto portion = reader.next(); !portion.empty(); portion = reader.next()) sum += portion.back().t_us;
    benchmark::DoNotOptimize(sum);
  }
  finish(state, file, events.size());
}

BENCHMARK(write_events)->ArgsProduct({{0, 1, 2, 3}, {0, 1}})->Unit(benchmark::kMillisecond);
BENCHMARK(read_portions)->ArgsProduct({{0, 1, 2, 3}, {0, 1}})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace touchstone::sensors

BENCHMARK_MAIN();
