#include "apps/frame_server.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <thread>

#include "apps/whole_request_server.h"
#include "core/error.h"

namespace touchstone::apps {
namespace {

constexpr int kThreads = 40;             // what streams and commands leave over answers the rest
constexpr int kSendBuffer = 256 * 1024;  // old frames that wait for a slow client

/// httplib's own way shares a port between servers.
void set_socket(int socket) {
  const int yes = 1;
  setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
}

}  // namespace

struct FrameServer::Parts {
  Parts(ServedCamera& shown, FramePages::Contents contents, double patience_s)
      : camera(shown), pages(shown, std::move(contents)), server(kThreads, patience_s) {
    server.set_socket_options(&set_socket);
    pages.add_to(server);
  }

  ServedCamera& camera;
  FramePages pages;
  WholeRequestServer server;
  int port = 0;
  std::atomic<bool> ended{false};
  std::thread listener;
};

FrameServer::FrameServer(ServedCamera& camera, FramePages::Contents contents, const Settings& how)
    : parts_(std::make_unique<Parts>(camera, std::move(contents), how.patience_s)) {
  errno = 0;
  parts_->port = how.port == 0 ? parts_->server.bind_to_any_port(how.address)
                               : (parts_->server.bind_to_port(how.address, how.port) ? how.port : -1);
  if (parts_->port <= 0) {
    fail("can't listen at {}:{}{}; another --port may be free, --port 0 takes any", how.address, how.port,
         errno == 0 ? std::string() : fmt::format(": {}", std::strerror(errno)));
  }
  parts_->listener = std::thread([this] {
    parts_->server.listen_after_bind();
    parts_->ended = true;
  });
  // Before it runs, stop() wouldn't stop it.
  while (!parts_->server.is_running() && !parts_->ended) std::this_thread::yield();
}

FrameServer::~FrameServer() {
  parts_->camera.stop();
  parts_->server.stop();
  parts_->listener.join();
}

int FrameServer::port() const {
  return parts_->port;
}

}  // namespace touchstone::apps
