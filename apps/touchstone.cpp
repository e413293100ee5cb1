// The one command. Exit codes: 0 done, 2 a mistake in what was given (one line on stderr says where), 1 anything else.

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <new>
#include <optional>
#include <string_view>

#include "apps/blas_kind.h"
#include "apps/command.h"
#include "core/error.h"
#include "core/memory_left.h"
#include "core/nearest_name.h"
#include "datasets/sets/processor.h"
#include "datasets/sets/run_identity.h"
#include "sim/press/gel_setup.h"

namespace touchstone::apps {
namespace {

constexpr int kDone = 0;
constexpr int kInternalFailure = 1;
constexpr int kUserMistake = 2;

/// Opens what is closed of descriptors 0 to 2: else the next file to be opened would be one of them, and what is
/// printed would go into it.
void hold_standard_descriptors() {
  int descriptor = 0;
  do {
    descriptor = open("/dev/null", O_RDWR);
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor > STDERR_FILENO) close(descriptor);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // which take terabytes of it
/// Runs before any library's own start: OpenBLAS' waits for ever where it can't have a buffer. Nothing of C++ is ready.
void require_address_space() {
  // 346 MB are mapped at last on 2 processors; on more, 8 MB each for OpenBLAS' own threads.
  constexpr rlim_t kLeast = 500'000'000;
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur >= kLeast) return;
  constexpr std::string_view kWhy =
      "touchstone: to begin takes 500 MB of address space; the limit of it (ulimit -v) is lower\n";
  if (write(STDERR_FILENO, kWhy.data(), kWhy.size()) < 0) _exit(kInternalFailure);
  _exit(kUserMistake);
}
[[gnu::section(".preinit_array"), gnu::used]] void (*const kFirst)() = require_address_space;
#endif

int complain(int code, const std::string& message) {
  std::string line = message;  // of what a file holds, it may hold anything
  std::ranges::replace_if(
      line, [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  std::fputs(("touchstone: " + line + "\n").c_str(), stderr);  // fmt would throw where stderr can't be written
  return code;
}

/// CLI11 only says that an unknown command "was not expected".
void refuse_unknown_command(const CLI::App& app, int argc, char** argv) {
  const CLI::App* at = &app;
  for (int i = 1; i < argc && argv[i][0] != '-'; ++i) {
    std::vector<std::string> known;
    for (const CLI::App* command : at->get_subcommands({})) known.push_back(command->get_name());
    if (known.empty()) return;
    const std::string name = argv[i];
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      const std::string what = at == &app                   ? "command"
                               : at->get_name() == "export" ? "thing that 'export' writes"
                                                            : "sensor of '" + at->get_name() + "'";
      fail("'{}' is not a {}{}; there are: {}", name, what, did_you_mean(name, known), fmt::join(known, ", "));
    }
    at = at->get_subcommand(name);
  }
}

int run(int argc, char** argv) {
  CLI::App app("Simulates vision-based tactile sensors and tests their estimators against known forces.", "touchstone");
  app.set_version_flag("--version", datasets::program_name());
  app.require_subcommand(1);
  app.fallthrough();
  GlobalOptions global;
  app.add_option("--threads", global.threads, "At most so many threads (default: all of the machine)")
      ->check(CLI::Range(1, 4096));
  app.add_flag("--quiet", global.quiet, "No progress on stderr");
  const CLI::Option* cache = app.add_option(
      "--cache", global.cache, "Folder of set-up results (default: $TOUCHSTONE_CACHE or ~/.cache/touchstone)");
  Action action;
  add_plan_command(app, global, action);
  add_render_command(app, global, action);
  add_generate_command(app, global, action);
  add_merge_command(app, global, action);
  add_calibrate_command(app, global, action);
  add_estimate_command(app, global, action);
  add_fit_command(app, global, action);
  add_compare_command(app, global, action);
  add_validate_command(app, global, action);
  add_inspect_command(app, global, action);
  add_export_command(app, global, action);
  add_record_command(app, global, action);
  add_study_command(app, global, action);
  add_bench_command(app, global, action);
  add_schema_command(app, action);
  add_serve_command(app, global, action);

  refuse_unknown_command(app, argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    return complain(kUserMistake, error.what());
  }
  std::optional<tbb::global_control> limit;
  if (global.threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(global.threads));
  }
  if (cache->empty()) global.cache = sim::default_cache_folder();
  datasets::reserve_blas_buffers();
  action();
  return kDone;
}

int guarded_run(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const Error& error) {
    return complain(kUserMistake, error.what());
  } catch (const std::bad_alloc&) {
    const MemoryLeft left = memory_left();
    return complain(kInternalFailure,
                    fmt::format("there isn't enough memory: {:.0f} MB are left by {}", left.bytes / 1e6, left.by));
  } catch (const std::exception& error) {
    if (std::ferror(stdout) != 0) return complain(kInternalFailure, std::string("stdout: ") + error.what());
    return complain(kInternalFailure, std::string("internal failure: ") + error.what());
  } catch (...) {
    return complain(kInternalFailure, "internal failure of an unknown kind");
  }
}

/// What was printed may still be in memory: only now a full disk shows.
int end_output(int code) {
  errno = 0;
  std::cout.flush();
  if ((std::fflush(stdout) == 0 && std::ferror(stdout) == 0) || code != kDone) return code;
  const char* const why = errno != 0 ? std::strerror(errno) : "some of it is lost";
  return complain(kInternalFailure, fmt::format("stdout: can't be written ({})", why));
}

}  // namespace
}  // namespace touchstone::apps

int main(int argc, char** argv) {
  touchstone::apps::hold_standard_descriptors();
  std::signal(SIGXFSZ, SIG_IGN);  // writing beyond a limit of file size is then an error that names the file
  spdlog::set_default_logger(spdlog::stderr_color_mt("touchstone"));
  spdlog::set_pattern("touchstone: %l: %v");
  touchstone::apps::choose_blas_kind(argv);
  return touchstone::apps::end_output(touchstone::apps::guarded_run(argc, argv));
}
