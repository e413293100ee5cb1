// Bytes that clients send to `touchstone serve`: taken piece by piece, then answered by a camera's pages as httplib
// gives them the request. All but sockets and threads.

#include <algorithm>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/frame_pages.h"
#include "apps/press_request.h"
#include "apps/whole_request.h"
#include "apps/whole_request_server.h"
#include "tests/fuzz/fuzz_target.h"

namespace touchstone::fuzz {
namespace {

constexpr std::size_t kMostAnswer = 64 * 1024;  // then the client is gone: a stream would go on for ever
constexpr double kRate_Hz = 1e6;                // a command waits for the next frame

/// A client that has sent its request and reads what comes.
class Client : public httplib::Stream {
 public:
  explicit Client(std::string request) : request_(std::move(request)) {}
  const std::string& answer() const { return answer_; }

  bool is_readable() const override { return true; }
  bool is_writable() const override { return true; }
  ssize_t read(char* to, std::size_t size) override {
    const std::size_t count = std::min(size, request_.size() - at_);
    std::memcpy(to, request_.data() + at_, count);
    at_ += count;
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* from, std::size_t size) override {
    if (answer_.size() + size > kMostAnswer) return -1;
    answer_.append(from, size);
    return static_cast<ssize_t>(size);
  }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return -1; }

 private:
  std::string request_;
  std::size_t at_ = 0;
  std::string answer_;
};

class Server : public httplib::Server {
 public:
  Server() : camera_(states(), kRate_Hz, 95), pages_(camera_, contents()) { pages_.add_to(*this); }

  std::string answer(const std::string& request) {
    Client client(request);
    bool closed = false;
    process_request(client, true, closed, nullptr);
    return client.answer();
  }

 private:
  static apps::ServedCamera::States states() {
    auto state = std::make_shared<lab::CameraState>();
    state->what = "nothing";
    state->expose = [](std::uint64_t) { return cv::Mat(4, 6, CV_8UC1, cv::Scalar(100)); };
    return {state};
  }
  apps::FramePages::Contents contents() {
    return {.title = "sensor",
            .sources = {.hosts = {"sensor.local"}, .origins = {"http://lab.example:3000"}},
            .commands = {{"/press", {[](const apps::Requested& asked) { apps::press_of(asked); }, "force_N=1"}},
                         {"/hold",
                          {[this](const apps::Requested& asked) {
                             apps::allow_only(asked, {"frame"});
                             camera_.hold(apps::count_of(asked, "frame"));
                           },
                           "frame=0"}},
                         {"/run",
                          {[this](const apps::Requested& asked) {
                             apps::allow_only(asked, {});
                             camera_.hold(std::nullopt);
                           },
                           ""}}}};
  }

  apps::ServedCamera camera_;
  apps::FramePages pages_;
};

/// The request as it is passed on; empty if it was refused or isn't there as a whole.
std::string taken(std::string_view bytes, std::size_t piece) {
  apps::WholeRequest request;
  try {
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
      if (request.take(bytes.substr(at, piece))) return request.text();
    }
  } catch (const apps::Refusal& refusal) {
    TS_ASSERT(refusal.status >= 400 && refusal.status < 600 && !refusal.message.empty());
  }
  return {};
}

}  // namespace

bool reads(std::string_view bytes) {
  static Server server;
  const std::string request = taken(bytes, std::max<std::size_t>(1, bytes.size()));
  // In pieces it is the same, but for what is refused before the head is there as a whole.
  const std::string in_pieces = taken(bytes, 7);
  TS_ASSERT(request == in_pieces);
  if (request.empty()) return false;
  const std::string answer = server.answer(request);
  TS_ASSERT(answer.starts_with("HTTP/1.1 "));
  const bool well = answer.starts_with("HTTP/1.1 200");
  const std::size_t body = answer.find("\r\n\r\n");
  TS_ASSERT(body != std::string::npos);
  if (!well && !request.starts_with("HEAD")) {
    // Every refusal says in a sentence what is wrong.
    const auto json = nlohmann::json::parse(answer.substr(body + 4));
    TS_ASSERT(!json.at("error").get<std::string>().empty());
  }
  return well;
}

}  // namespace touchstone::fuzz
