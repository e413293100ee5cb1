#include <spdlog/spdlog.h>

#include <cstdio>
#include <memory>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "datasets/sets/generate.h"

namespace touchstone::apps {
namespace {

struct Options {
  std::filesystem::path job;
  std::filesystem::path out;
  std::string shard;
  bool no_timings = false;
};

void generate(const Options& options, const GlobalOptions& global) {
  datasets::GenerateOptions how = datasets::simulated(global.cache);
  how.threads = global.threads;
  how.timings = !options.no_timings;
  if (!options.shard.empty()) how.shard = datasets::shard_of(options.shard);
  datasets::GenerateReport report;
  {
    ProgressBar bar(global.quiet);
    if (!global.quiet) {
      how.predicted = [&](const sim::RunCost& cost) {
        fmt::print("{}\n", sim::in_words(cost));
        for (const std::string& one : cost.unknown) fmt::print("  not known: {}\n", one);
        std::fflush(stdout);
        for (const auto& [stage, seconds] :
             {std::pair{"elasticity", cost.gel_s}, std::pair{"mechanics", cost.mechanics_s},
              std::pair{"cameras", cost.cameras_s}, std::pair{"frames", cost.frames_s},
              std::pair{"samples", cost.frames_s}}) {
          bar.expect(stage, seconds);
        }
      };
    }
    report = datasets::generate(options.job, options.out, how, bar.listener());
  }
  if (!report.warning.empty()) spdlog::warn("{}", report.warning);
  if (report.was_finished) {
    print_finished(options.out, report.samples);
    return;
  }
  fmt::print("{}: {} samples, {} of them made", options.out.string(), report.samples, report.made);
  if (report.kept > 0) fmt::print(", {} kept from an earlier run", report.kept);
  if (report.damaged_blocks > 0) fmt::print(", {} damaged files made again", report.damaged_blocks);
  if (report.drawn_again > 0) fmt::print(", {} touches drawn again", report.drawn_again);
  if (report.press_s > 0.0) {
    fmt::print("; {:.1f} s setting up units, {:.1f} s pressing and rendering, {:.1f} s writing", report.set_up_s,
               report.press_s, report.write_s);
  }
  fmt::print("\n");
  if (how.shard.count > 1) {
    fmt::print("when all {} shards are there: touchstone merge {} -o {}\n", how.shard.count, options.job.string(),
               options.out.string());
  }
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
