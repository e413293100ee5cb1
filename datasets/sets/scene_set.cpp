#include "datasets/sets/scene_set.h"

#include <tbb/info.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>

#include "core/error.h"
#include "core/random.h"
#include "core/random_pairs.h"
#include "core/sha256.h"
#include "core/whole_file.h"
#include "datasets/jobs/scene_plan.h"
#include "datasets/sets/job_cost.h"
#include "datasets/sets/manifest.h"
#include "datasets/sets/run_folder.h"
#include "datasets/sets/scene_manifest.h"
#include "datasets/sets/truth_file.h"
#include "datasets/sets/whole_steps.h"
#include "sensors/events/event_file.h"
#include "sim/files/image_file.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;

/// Counts steps of a stage, from several threads.
class Counter {
 public:
  Counter(const Progress& progress, std::string stage, std::int64_t total)
      : progress_(progress), stage_(std::move(stage)), total_(total) {}
  void step() {
    const std::int64_t done = ++done_;
    if (progress_) progress_(stage_, done, total_);
  }

 private:
  const Progress& progress_;
  std::string stage_;
  std::int64_t total_;
  std::atomic<std::int64_t> done_{0};
};

/// Wall seconds of stages.
class StageClock {
 public:
  void end(const std::string& stage) {
    const auto now = std::chrono::steady_clock::now();
    stages.emplace_back(stage, std::chrono::duration<double>(now - last_).count());
    last_ = now;
  }
  std::vector<std::pair<std::string, double>> stages;

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

WrittenFile written(const fs::path& out, const std::string& name) {
  return {name, sha256_of_file(out / name), static_cast<std::int64_t>(fs::file_size(out / name))};
}

/// The kinds of picture that a scene's outputs ask for.
struct PictureKinds {
  bool frames = false, ideal = false, radiance = false, height = false, pixels = false;

  explicit PictureKinds(const PreparedScene& scene)
      : frames(scene.plan.camera && scene.spec.outputs.frames),
        ideal(scene.plan.camera && scene.spec.outputs.ideal),
        radiance(scene.plan.camera && scene.spec.outputs.radiance),
        height(scene.spec.outputs.height),
        pixels(scene.plan.camera && scene.spec.outputs.pixel_truth()) {}
  bool any() const { return frames || ideal || radiance || height || pixels; }
};

/// One sample's place in the job.
struct SamplePlace {
  std::size_t scene = 0;
  std::int64_t frame = 0;
};

/// A run of a job from mechanics to manifest.
class Run {
 public:
  Run(const PreparedJob& job, const fs::path& out, const SampleSource& source, const Progress& progress)
      : job_(job), out_(out), source_(source), progress_(progress) {}

  void predict(const GenerateOptions& options, std::size_t kept) {
    if (!options.predicted) return;
    try {
      const sim::MachineRates rates = sim::machine_rates(options.threads, options.cache, progress_);
      predicted_ = sim::run_cost(scene_costs(job_, rates, options.cache, progress_), rates);
      predicted_->frames_s *= 1.0 - std::min(1.0, static_cast<double>(kept) / static_cast<double>(job_.samples));
      options.predicted(*predicted_);
    } catch (const Error&) {
      // What is wrong with a scene is said where it is simulated.
    }
    clock_.end("prediction");
  }

  void mechanics() {
    gel_ = source_.set_up_gel(job_.scenes.front().spec.device, progress_);
    report_.warn(gel_->report.note);
    for (const PreparedScene& scene : job_.scenes) {
      for (const std::string& doubt : scene.plan.warnings) report_.warn(doubt);
    }
    clock_.end("gel");
    truths_.resize(job_.scenes.size());
    Counter counter(progress_, "mechanics", job_.samples);
    const auto count = [&](const std::string&, std::int64_t, std::int64_t) { counter.step(); };
    for_each_whole(job_.scenes.size(), [&](std::size_t i) {
      const PreparedScene& scene = job_.scenes[i];
      truths_[i] = source_.play_motion(scene.spec, scene.plan, *gel_, count);
      TS_ASSERT(static_cast<std::int64_t>(truths_[i].size()) == scene.samples);
    });
    clock_.end("mechanics");
  }

  /// Makes the pictures of all samples that `kept` doesn't hold.
  void pictures(RunFolder& folder, const std::vector<FrameRecord>& kept) {
    records_.assign(static_cast<std::size_t>(job_.samples) + job_.scenes.size(), std::nullopt);
    for (const FrameRecord& record : kept) {
      if (record.sample < 0 || record.sample >= static_cast<std::int64_t>(records_.size())) continue;
      records_[static_cast<std::size_t>(record.sample)] = record;
      if (record.sample < job_.samples) ++report_.kept;
    }
    make_folders();
    RunJournal journal(folder.journal(), kept);
    folder.keep();
    const std::vector<SampleSource::Camera> cameras = set_up_cameras();
    clock_.end("cameras");

    std::vector<SamplePlace> missing;
    for (std::size_t i = 0; i < job_.scenes.size(); ++i) {
      if (!PictureKinds(job_.scenes[i]).any()) continue;
      for (std::int64_t frame = 0; frame < job_.scenes[i].samples; ++frame) {
        if (!record_of({i, frame})) missing.push_back({i, frame});
      }
    }
    Counter counter(progress_, "frames", static_cast<std::int64_t>(missing.size()));
    for_each_whole(missing.size(), [&](std::size_t i) {
      const SamplePlace place = missing[i];
      record_of(place) = make_pictures(cameras[place.scene], place);
      journal.append(*record_of(place));
      counter.step();
    });
    report_.made = static_cast<std::int64_t>(missing.size());
    clock_.end("frames");
    events(journal);
  }

  void truth() {
    TruthHeader header;
    header.job_name = job_.job.name;
    header.version = program_version();
    header.samples = job_.samples;
    header.objects = static_cast<std::int64_t>(sim::moved_objects(job_.scenes.front().spec).size());
    for (const PreparedScene& scene : job_.scenes) header.scenes.push_back(scene.entry.name);
    const auto& beads = job_.scenes.front().spec.device.beads;
    if (beads) header.bead_rest = sim::bead_centres(*beads);
    Counter counter(progress_, "truth", job_.samples);
    write_whole_file(out_ / "truth.h5", [&](const fs::path& temporary) {
      TruthFileWriter writer(temporary, header, *gel_);
      for (std::size_t i = 0; i < truths_.size(); ++i) {
        for (const sim::Truth& truth : truths_[i]) {
          writer.append(static_cast<int>(i), job_.scenes[i].entry.split, truth);
          counter.step();
        }
      }
      writer.close();
      arrays_ = writer.arrays();
    });
    clock_.end("truth");
  }

  void manifest(const RunIdentity& identity, const GenerateOptions& options) {
    CountedWork work;
    std::vector<WrittenFile> files;
    for (const auto& record : records_) {
      if (!record) continue;
      files.insert(files.end(), record->files.begin(), record->files.end());
      if (record->sample < job_.samples) work.pictures += static_cast<std::int64_t>(record->files.size());
      work.pixels_traced += record->pixels_traced;
      work.paths_traced += record->paths_traced;
    }
    work.light.resize(job_.scenes.size());
    for (std::size_t i = 0; i < job_.scenes.size(); ++i) {
      for (std::int64_t frame = 0; frame < job_.scenes[i].samples; ++frame) {
        const auto& record = record_of({i, frame});
        if (record && !record->light.empty()) ++work.light[i][record->light];
      }
    }
    files.push_back(written(out_, "truth.h5"));
    std::sort(files.begin(), files.end(), [](const WrittenFile& a, const WrittenFile& b) { return a.name < b.name; });
    RunTimings timings;
    timings.stages = clock_.stages;
    if (predicted_) {
      timings.predicted = {{"gel", predicted_->gel_s},
                           {"mechanics", predicted_->mechanics_s},
                           {"cameras", predicted_->cameras_s},
                           {"frames", predicted_->frames_s}};
    }
    timings.threads = options.threads > 0 ? options.threads : tbb::info::default_concurrency();
    timings.samples_made = report_.made;
    write_manifest(
        out_, scene_manifest(job_, identity, gel_->report, arrays_, files, work, options.timings ? &timings : nullptr),
        files);
  }

  GenerateReport report() const {
    GenerateReport report = report_;
    report.samples = job_.samples;
    return report;
  }

 private:
  /// Writes the streams of events that `records_` doesn't hold, one after the other: each keeps all threads busy.
  void events(RunJournal& journal) {
    bool any = false;
    for (std::size_t i = 0; i < job_.scenes.size(); ++i) {
      const PreparedScene& scene = job_.scenes[i];
      if (!scene.plan.events || stream_of(i)) continue;
      any = true;
      std::error_code error;
      fs::create_directories(out_ / "events", error);
      if (error) fail("{}: can't be made ({})", (out_ / "events").string(), error.message());
      const std::string name = "events/" + scene.entry.name + ".h5";
      RandomStream seeds(scene.spec.seed, static_cast<std::uint64_t>(scene.first_sample), Purpose::kEventNoise);
      const std::uint64_t noise_seed = next_seed(seeds);
      const sim::CameraSpec& camera = scene.spec.device.camera.value();
      FrameRecord record;
      record.sample = job_.samples + static_cast<std::int64_t>(i);
      write_whole_file(out_ / name, [&](const fs::path& temporary) {
        sensors::EventWriter writer(temporary, {camera.width, camera.height}, program_name());
        const sim::EventStreamReport report = source_.watch_events(
            scene.spec, scene.plan, *gel_, noise_seed, [&](std::span<const Event> events) { writer.append(events); },
            progress_);
        writer.close();
        record.pixels_traced = report.pixels_traced;
        record.paths_traced = report.paths_traced;
      });
      record.files.push_back(written(out_, name));
      stream_of(i) = record;
      journal.append(record);
    }
    if (any) clock_.end("events");
  }

  /// The record of a scene's stream of events; they come after those of all samples.
  std::optional<FrameRecord>& stream_of(std::size_t scene) {
    return records_[static_cast<std::size_t>(job_.samples) + scene];
  }

  std::optional<FrameRecord>& record_of(SamplePlace place) {
    return records_[static_cast<std::size_t>(job_.scenes[place.scene].first_sample + place.frame)];
  }

  void make_folders() const {
    for (const PreparedScene& scene : job_.scenes) {
      const PictureKinds kinds(scene);
      for (const auto& [name, wanted] :
           {std::pair{"frames", kinds.frames}, std::pair{"ideal", kinds.ideal}, std::pair{"radiance", kinds.radiance},
            std::pair{"height", kinds.height}, std::pair{"pixels", kinds.pixels}}) {
        if (!wanted) continue;
        const fs::path folder = out_ / name / scene.entry.name;
        std::error_code error;
        fs::create_directories(folder, error);
        if (error) fail("{}: can't be made ({})", folder.string(), error.message());
      }
    }
  }

  /// Cameras of the scenes that still need pictures; the others stay empty.
  std::vector<SampleSource::Camera> set_up_cameras() {
    std::vector<std::size_t> needed;
    for (std::size_t i = 0; i < job_.scenes.size(); ++i) {
      if (!PictureKinds(job_.scenes[i]).any()) continue;
      for (std::int64_t frame = 0; frame < job_.scenes[i].samples; ++frame) {
        if (!record_of({i, frame})) {
          needed.push_back(i);
          break;
        }
      }
    }
    std::vector<SampleSource::Camera> cameras(job_.scenes.size());
    Counter counter(progress_, "cameras", static_cast<std::int64_t>(needed.size()));
    for_each_whole(needed.size(), [&](std::size_t k) {
      const std::size_t i = needed[k];
      const PreparedScene& scene = job_.scenes[i];
      cameras[i] = source_.set_up_camera(scene.spec, scene.plan, gel_, truths_[i]);
      counter.step();
    });
    return cameras;
  }

  /// A truth whose frame number is its sample index, so that no two samples of a data set share their noise.
  sim::Truth numbered(std::size_t scene, std::int64_t frame) const {
    sim::Truth truth = truths_[scene][static_cast<std::size_t>(frame)];
    truth.frame = static_cast<int>(job_.scenes[scene].first_sample + frame);
    return truth;
  }

  FrameRecord make_pictures(const SampleSource::Camera& camera, SamplePlace place) const {
    const PreparedScene& scene = job_.scenes[place.scene];
    const PictureKinds kinds(scene);
    const sim::Capture capture = camera(numbered(place.scene, place.frame));
    FrameRecord record;
    record.sample = scene.first_sample + place.frame;
    record.pixels_traced = capture.pixels_traced;
    record.paths_traced = capture.paths_traced;
    record.light = capture.light;
    const auto png = [&](const std::string& folder, const cv::Mat& picture) {
      const std::string name = picture_name(folder, scene.entry.name, place.frame, "png");
      sim::write_png(out_ / name, picture);
      record.files.push_back(written(out_, name));
    };
    if (kinds.frames) png("frames", capture.frame);
    if (kinds.ideal) png("ideal", capture.ideal);
    if (kinds.radiance) {
      const std::string name = picture_name("radiance", scene.entry.name, place.frame, "exr");
      sim::write_exr(out_ / name, capture.radiance, sim::channel_names(scene.plan.bands));
      record.files.push_back(written(out_, name));
    }
    if (kinds.height) {
      const std::string name = picture_name("height", scene.entry.name, place.frame, "exr");
      const sim::ImageMetadata metadata = {{"unit", "mm"},
                                           {"pixel_um", fmt::format("{}", scene.spec.membrane.pixel_um)}};
      sim::write_exr(out_ / name, capture.height, {"height"}, metadata);
      record.files.push_back(written(out_, name));
    }
    if (kinds.pixels) {
      const std::string name = picture_name("pixels", scene.entry.name, place.frame, "exr");
      sim::write_exr(out_ / name, capture.pixel_truth.image, capture.pixel_truth.channel_names);
      record.files.push_back(written(out_, name));
    }
    return record;
  }

  const PreparedJob& job_;
  fs::path out_;
  const SampleSource& source_;
  const Progress& progress_;
  StageClock clock_;
  std::shared_ptr<const fem::Compliance> gel_;
  std::vector<std::vector<sim::Truth>> truths_;      // a list a scene
  std::vector<std::optional<FrameRecord>> records_;  // of each sample, then of each scene's stream of events
  std::vector<ArrayShape> arrays_;
  GenerateReport report_;
  std::optional<sim::RunCost> predicted_;
};

}  // namespace

GenerateReport generate_scenes(const PreparedJob& job, const fs::path& out, const GenerateOptions& options,
                               const Progress& progress) {
  const RunIdentity identity = identity_of(job);
  GenerateReport finished;
  finished.was_finished = true;
  finished.samples = job.samples;
  if (state_of_folder(out, identity) == FolderState::finished && !fs::exists(out / kUnfinished)) {
    verify_files(out, read_manifest(out));
    return finished;
  }
  RunFolder folder(out, identity);
  if (state_of_folder(out, identity) == FolderState::finished) {  // killed between its last file and clearing up
    verify_files(out, read_manifest(out));
    folder.finish();
    return finished;
  }
  PreparedJob planned = job;
  plan_by_need(planned, options.cache, progress);
  Run run(planned, out, options.scenes, progress);
  const std::vector<FrameRecord> kept = folder.whole_records();
  run.predict(options, kept.size());
  run.mechanics();
  run.pictures(folder, kept);
  run.truth();
  run.manifest(identity, options);
  folder.finish();
  return run.report();
}

}  // namespace touchstone::datasets
