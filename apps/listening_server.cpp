#include "apps/listening_server.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "core/error.h"

namespace touchstone::apps {

void ListeningServer::keep_port(int socket) {
  const int yes = 1;
  setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

void ListeningServer::begin(const std::string& address, int port, const Words& words) {
  errno = 0;
  port_ = port == 0 ? bind_to_any_port(address) : (bind_to_port(address, port) ? port : -1);
  if (port_ <= 0) {
    fail("{}can't listen at {}:{}{}; {}", words.before, address, port,
         errno == 0 ? std::string() : fmt::format(": {}", std::strerror(errno)), words.advice);
  }
  listener_ = std::thread([this] {
    listen_after_bind();
    ended_ = true;
  });
  // Before it runs, stop() wouldn't stop it.
  while (!is_running() && !ended_) std::this_thread::yield();
}

void ListeningServer::end() {
  stop();
  listener_.join();
}

}  // namespace touchstone::apps
