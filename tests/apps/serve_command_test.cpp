#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>

#include "sensors/events/event_file.h"
#include "tests/apps/run_program.h"
#include "tests/support/small_job.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

using nlohmann::json;
using test::expect_refused;
using test::run_program;
using test::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr int kPatience_s = 60;

/// A socket to a port of this machine.
class Connection {
 public:
  explicit Connection(int port) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(static_cast<std::uint16_t>(port));
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    open_ = ::connect(fd_, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
  }
  ~Connection() { ::close(fd_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  bool open() const { return open_; }
  void send(const std::string& text) const {
    EXPECT_EQ(::send(fd_, text.data(), text.size(), MSG_NOSIGNAL), static_cast<ssize_t>(text.size()));
  }
  /// Until the other side ends, or `enough` bytes are there.
  std::string receive(std::size_t enough = SIZE_MAX) const {
    std::string all;
    char part[65536];
    while (all.size() < enough) {
      pollfd ready{fd_, POLLIN, 0};
      if (::poll(&ready, 1, kPatience_s * 1000) <= 0) break;
      const ssize_t got = ::recv(fd_, part, sizeof part, 0);
      if (got <= 0) break;
      all.append(part, static_cast<std::size_t>(got));
    }
    return all;
  }

 private:
  int fd_;
  bool open_ = false;
};

/// The program as a server, from its start to a signal.
class Served {
 public:
  Served(const TemporaryFolder& folder, std::vector<std::string> arguments) {
    std::vector<std::string> words = {
        TOUCHSTONE_PROGRAM, "--quiet", "--cache", (folder.path() / "cache").string(), "serve", "--port", "0"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    int out[2];
    EXPECT_EQ(pipe2(out, O_CLOEXEC), 0);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, out[1], STDOUT_FILENO);
    EXPECT_EQ(posix_spawn(&process_, words[0].c_str(), &files, nullptr, argv.data(), environ), 0);
    posix_spawn_file_actions_destroy(&files);
    ::close(out[1]);
    out_ = out[0];
    while (said_.find("Ctrl-C stops") == std::string::npos) {
      char part[4096];
      pollfd ready{out_, POLLIN, 0};
      if (::poll(&ready, 1, kPatience_s * 1000) <= 0) break;
      const ssize_t got = ::read(out_, part, sizeof part);
      if (got <= 0) break;
      said_.append(part, static_cast<std::size_t>(got));
    }
    port_ = port_after("frames: http://127.0.0.1:");
  }
  ~Served() {
    if (process_ > 0) stop(SIGKILL);
    ::close(out_);
  }

  int port() const { return port_; }
  int port_after(const std::string& words) const {
    const std::size_t at = said_.find(words);
    return at == std::string::npos ? 0 : std::atoi(said_.c_str() + at + words.size());
  }
  std::string url(const std::string& path) const { return "http://127.0.0.1:" + std::to_string(port_) + path; }
  /// Head and body of the answer.
  std::string ask(const std::string& path, const std::string& method = "GET") const {
    const Connection to(port_);
    to.send(method + " " + path + " HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
    return to.receive();
  }
  json ask_json(const std::string& path, const std::string& method = "GET") const {
    const std::string answer = ask(path, method);
    return json::parse(answer.substr(answer.find("\r\n\r\n") + 4));
  }
  /// Its exit code; -1 if the signal ended it.
  int stop(int signal) {
    ::kill(process_, signal);
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t process_ = 0;
  int out_ = -1;
  std::string said_;
  int port_ = 0;
};

class ServeScene : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    test::write_small_job(*folder_);
    served_ = new Served(*folder_, {(folder_->path() / "scene.yaml").string(), "--rate", "100"});
    ASSERT_GT(served_->port(), 0);
  }
  static void TearDownTestSuite() {
    EXPECT_EQ(served_->stop(SIGINT), 0) << "a clean stop";
    delete served_;
    delete folder_;
  }
  static TemporaryFolder* folder_;
  static Served* served_;
};
TemporaryFolder* ServeScene::folder_ = nullptr;
Served* ServeScene::served_ = nullptr;

TEST_F(ServeScene, IsOpenedByOpenCVLikeANetworkCamera) {
  cv::VideoCapture camera(served_->url("/stream.mjpg"));
  ASSERT_TRUE(camera.isOpened());
  cv::Mat first, frame;
  ASSERT_TRUE(camera.read(first));
  EXPECT_EQ(first.size(), cv::Size(48, 36));
  bool moved = false;
  for (int i = 0; i < 12; ++i) {
    ASSERT_TRUE(camera.read(frame));
    moved = moved || cv::norm(frame, first, cv::NORM_INF) > 20.0;
  }
  EXPECT_TRUE(moved) << "the ball comes and goes within 6 frames";
}

TEST_F(ServeScene, TellsTheTruthOfAFrameByItsNumber) {
  const std::string answer = served_->ask("/frame.jpg");
  EXPECT_THAT(answer,
              AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("Content-Type: image/jpeg"), HasSubstr("\r\n\r\n\xFF\xD8")));
  const std::string header = "X-Touchstone-Frame: ";
  const std::string number = std::to_string(std::atoi(answer.c_str() + answer.find(header) + header.size()));
  const json truth = served_->ask_json("/truth.json?frame=" + number);
  EXPECT_EQ(std::to_string(truth["frame"].get<int>()), number);
  EXPECT_EQ(truth["scene_frame"], std::atoi(number.c_str()) % 6);
  EXPECT_THAT(served_->ask_json("/truth.json?frame=2000000000")["error"].get<std::string>(),
              HasSubstr("isn't due yet"));
  EXPECT_THAT(served_->ask_json("/truth.json?frame=-1")["error"].get<std::string>(), HasSubstr("-1 isn't allowed"));
  EXPECT_THAT(served_->ask_json("/truth.json?frme=1")["error"].get<std::string>(), HasSubstr("did you mean 'frame'?"));
}

TEST_F(ServeScene, CanBeHeldAtAFrameWhoseForceIsKnown) {
  const json status = served_->ask_json("/hold?frame=5", "POST");
  EXPECT_EQ(status["scene_frame"], 5);
  EXPECT_GT(status["force_N"][2], 0.1) << "pressed 0.3 mm deep";
  EXPECT_GT(status["force_error_N"][2], 0.0);
  EXPECT_NEAR(status["gel_from_object"][2][3].get<double>(), 1.7, 1e-9);
  const auto jpeg = [](const std::string& answer) { return answer.substr(answer.find("\r\n\r\n")); };
  const std::string one = jpeg(served_->ask("/frame.jpg"));
  std::string other = one;
  while (other == one) other = jpeg(served_->ask("/frame.jpg"));  // the next frame has noise of its own
  EXPECT_EQ(served_->ask_json("/status.json")["scene_frame"], 5);
  EXPECT_THAT(served_->ask("/hold?frame=6", "POST"), AllOf(StartsWith("HTTP/1.1 400"), HasSubstr("allowed is 0 to 5")));
  EXPECT_THAT(served_->ask("/press", "POST"), StartsWith("HTTP/1.1 404")) << "of devices";
  EXPECT_EQ(served_->ask_json("/hold?frame=0", "POST")["force_N"][2], 0.0);
  EXPECT_THAT(served_->ask("/run", "POST"), StartsWith("HTTP/1.1 200"));
}

TEST_F(ServeScene, AClientThatTakesNothingHoldsNobody) {
  const Connection lazy(served_->port());
  lazy.send("GET /stream.mjpg HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_THAT(lazy.receive(100), HasSubstr("multipart/x-mixed-replace"));
  std::vector<cv::VideoCapture> cameras;
  cameras.reserve(3);
  for (int i = 0; i < 3; ++i) cameras.emplace_back(served_->url("/stream.mjpg"));
  cv::Mat frame;
  for (cv::VideoCapture& camera : cameras) {
    ASSERT_TRUE(camera.isOpened());
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(camera.read(frame));
  }
  EXPECT_GE(served_->ask_json("/status.json")["clients"], 4);
}

TEST_F(ServeScene, APortThatIsTakenIsAnError) {
  expect_refused(run_program({"--quiet", "--cache", (folder_->path() / "cache").string(), "serve",
                              (folder_->path() / "scene.yaml").string(), "--port", std::to_string(served_->port())}),
                 "can't listen at 127.0.0.1:" + std::to_string(served_->port()) + ": Address already in use");
}

TEST(Serve, RefusesWhatItCannotShow) {
  const TemporaryFolder folder;
  test::write_small_job(folder);
  const auto refused = [&](const std::string& what, const std::vector<std::string>& more, const std::string& part) {
    std::vector<std::string> words = {"--cache", (folder.path() / "cache").string(), "serve",
                                      (folder.path() / what).string()};
    words.insert(words.end(), more.begin(), more.end());
    expect_refused(run_program(words), part);
  };
  refused("motion.yaml", {}, "is neither a device (which has a gel) nor a scene");
  refused("scene.yaml", {"--frames", "2", "9"}, "the scene has frames 0 to 5");
  refused("scene.yaml", {"--events-port", "1"}, "the scene's outputs have no events");
  refused("device.yaml", {"--frames", "0", "1"}, "is a device and has no frames");
  refused("device.yaml", {"--host", "sensor.local:80"}, "--host sensor.local:80: must be a name without a port");
  refused("device.yaml", {"--allow-origin", "lab"}, "--allow-origin lab: must be as http://localhost:3000");
  folder.write("blind.yaml", test::kSmallDevice);
  refused("blind.yaml", {}, "has no camera");
}

TEST(Serve, ADeviceIsPressedOnRequest) {
  const TemporaryFolder folder;
  test::write_small_job(folder);
  Served served(folder,
                {(folder.path() / "device.yaml").string(), "--object", (folder.path() / "object.yaml").string()});
  ASSERT_GT(served.port(), 0);
  EXPECT_EQ(served.ask_json("/status.json")["force_N"][2], 0.0);
  const json held = served.ask_json("/press?force_N=0.2&x_mm=0.5", "POST");
  EXPECT_NEAR(held["force_N"][2].get<double>(), 0.2, 1e-5);
  EXPECT_EQ(held["gel_from_object"][0][3], 0.5);
  EXPECT_THAT(held["what"].get<std::string>(), HasSubstr("ball at (0.5, 0) mm with 0.2 N"));
  const auto error = [&](const std::string& path) { return served.ask_json(path, "POST")["error"].get<std::string>(); };
  EXPECT_THAT(error("/press?force_N=0.2&object=bal"), HasSubstr("object: 'bal' isn't known"));
  EXPECT_THAT(error("/press?force_N=heavy"), HasSubstr("force_N: 'heavy' isn't a number"));
  EXPECT_THAT(error("/press?force_N=0.2&object=%00"), HasSubstr(R"(object: '\x00' isn't known)"));
  EXPECT_LT(error("/press?force_N=0.2&object=" + std::string(5000, 'x')).size(), 2000u);
  EXPECT_THAT(error("/press?force_N=0.2&turn_x_deg=1e308"), HasSubstr("turn_x_deg: 1e+308 isn't allowed"));
  EXPECT_THAT(error("/press"), HasSubstr("for example, as a body or after '?': object=object&"));
  EXPECT_THAT(error("/press?force_N=1&x_mm=50"), HasSubstr("isn't over the gel"));
  EXPECT_EQ(served.ask_json("/status.json")["force_N"][2], held["force_N"][2]) << "a refused press changes nothing";
  EXPECT_EQ(served.ask_json("/release", "POST")["force_N"][2], 0.0);
  const Connection watching(served.port());
  watching.send("GET /stream.mjpg HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_GT(watching.receive(2000).size(), 1000u);
  EXPECT_EQ(served.stop(SIGTERM), 0) << "with a client on it";
}

TEST(Serve, EventsComeAsTheyHappenOverASocket) {
  const TemporaryFolder folder;
  test::write_small_job(folder);
  folder.write("events-device.yaml", std::string(test::kSmallDevice) + test::kSmallCamera +
                                         "  events: {dark_e_per_s: 1000, on_threshold: 0.15, off_threshold: 0.15}\n");
  folder.write("events-scene.yaml",
               "device: events-device.yaml\nobject: object.yaml\nmotion: motion.yaml\n"
               "light: {min_samples: 4, max_samples: 4}\noutputs: {frames: true, events: true}\n");
  Served served(folder, {(folder.path() / "events-scene.yaml").string()});
  ASSERT_GT(served.port(), 0);
  const int port = served.port_after("events: tcp://127.0.0.1:");
  ASSERT_GT(port, 0);
  EXPECT_THAT(served.ask("/hold?frame=0", "POST"), StartsWith("HTTP/1.1 404")) << "events can't stand still";
  std::string raw;
  {
    const Connection gone(port);  // one that leaves at once
    const Connection idle(port);  // one that never reads
    const Connection to(port);
    ASSERT_TRUE(to.open());
    raw = to.receive(20000);
  }
  EXPECT_EQ(served.stop(SIGINT), 0);
  raw.resize(raw.size() / 2 * 2);
  const std::size_t header = raw.find("% end\n") + 6;
  raw.resize(header + (raw.size() - header) / 2 * 2);
  const sensors::EventRecording read = sensors::read_events(folder.write("received.raw", raw));
  EXPECT_EQ(read.source.format, sensors::EventFormat::evt3);
  ASSERT_GT(read.events.size(), 1000u);
  EXPECT_GT(read.events.back().t_us - read.events.front().t_us, 100'000) << "half a scene at least, as time passes";
}

}  // namespace
}  // namespace touchstone
