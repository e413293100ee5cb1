#include <spdlog/spdlog.h>

#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "datasets/jobs/draw.h"
#include "datasets/sets/dataset.h"
#include "datasets/sets/drawn_dataset.h"

namespace touchstone::apps {
namespace {

struct Options {
  std::filesystem::path job;
  std::filesystem::path out;
  std::string shard;
  bool no_timings = false;
};

/// A job that draws its samples.
void generate_drawn(const Options& options, const GlobalOptions& global) {
  datasets::DrawnOptions how;
  how.source = datasets::virtual_sensors(global.cache);
  how.threads = global.threads;
  if (!options.shard.empty()) how.shard = datasets::shard_of(options.shard);
  datasets::DrawnReport report;
  {
    ProgressBar bar(global.quiet);
    report = datasets::generate_drawn(options.job, options.out, how, bar.listener());
  }
  if (report.was_finished) {
    print_finished(options.out, report.samples);
    return;
  }
  fmt::print("{}: {} samples, {} of them made", options.out.string(), report.samples, report.made);
  if (report.kept > 0) fmt::print(", {} kept from an earlier run", report.kept);
  if (report.damaged_blocks > 0) fmt::print(", {} damaged files made again", report.damaged_blocks);
  if (report.drawn_again > 0) fmt::print(", {} touches drawn again", report.drawn_again);
  fmt::print("; {:.1f} s setting up units, {:.1f} s pressing and rendering, {:.1f} s writing\n", report.set_up_s,
             report.press_s, report.write_s);
  if (how.shard.count > 1) {
    fmt::print("when all {} shards are there: touchstone merge {} -o {}\n", how.shard.count, options.job.string(),
               options.out.string());
  }
}

void generate(const Options& options, const GlobalOptions& global) {
  if (datasets::is_draw_job_file(options.job)) {
    generate_drawn(options, global);
    return;
  }
  if (!options.shard.empty()) fail("--shard: {} isn't a job that draws; only those have shards", options.job.string());
  datasets::GenerateOptions how;
  how.source = datasets::simulator(global.cache);
  how.threads = global.threads;
  how.timings = !options.no_timings;
  datasets::GenerateReport report;
  {
    ProgressBar bar(global.quiet);
    report = datasets::generate(options.job, options.out, how, bar.listener());
  }
  if (!report.warning.empty()) spdlog::warn("{}", report.warning);
  if (report.was_finished) {
    print_finished(options.out, report.samples);
    return;
  }
  fmt::print("{}: {} samples, {} of them rendered", options.out.string(), report.samples, report.rendered);
  if (report.kept > 0) fmt::print(", {} kept from a run that was broken off", report.kept);
  fmt::print("\n");
}

}  // namespace

void print_finished(const std::filesystem::path& out, std::int64_t samples) {
  fmt::print("{}: is finished already; all of its checksums hold ({} samples)\n", out.string(), samples);
}

void add_generate_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* command =
      app.add_subcommand("generate", "Make a labelled data set; the same command goes on with one that was broken off");
  auto options = std::make_shared<Options>();
  command->add_option("JOB", options->job, "Job file")->required();
  command->add_option("-o,--out", options->out, "Folder of the data set: new, empty, or this job's own")->required();
  command->add_option("--shard", options->shard,
                      "I/N: of a job that draws, only the I-th of N parts; `touchstone merge` puts them together");
  command->add_flag("--no-timings", options->no_timings,
                    "Leave wall times out of dataset.json: then the whole folder is the same bytes in every run");
  command->callback([&action, &global, options] { action = [options, &global] { generate(*options, global); }; });
}

}  // namespace touchstone::apps
