#pragma once
// A network camera for tests: one client gets JPEGs as multipart/x-mixed-replace, as `touchstone serve` sends them.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <utility>

namespace touchstone::test {

class MjpegServer {
 public:
  /// @param jpeg frame number i; "" for the end, at which the connection closes, or with `stalls` stays open
  explicit MjpegServer(std::function<std::string(int)> jpeg, bool stalls = false)
      : jpeg_(std::move(jpeg)), stalls_(stalls), listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at;
    ::bind(listener_, reinterpret_cast<const sockaddr*>(&at), sizeof at);
    ::listen(listener_, 4);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&at), &size);
    port_ = ntohs(at.sin_port);
    server_ = std::thread([this] { serve(); });
  }
  ~MjpegServer() {
    ended_ = true;
    ::shutdown(listener_, SHUT_RDWR);
    server_.join();
    ::close(listener_);
  }
  MjpegServer(const MjpegServer&) = delete;
  MjpegServer& operator=(const MjpegServer&) = delete;

  std::string url() const { return "http://127.0.0.1:" + std::to_string(port_) + "/stream.mjpg"; }

 private:
  void serve() {
    while (!ended_) {
      const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      if (client < 0) return;
      answer(client);
      ::close(client);
    }
  }
  void answer(int client) {
    char request[4096];
    if (::recv(client, request, sizeof request, 0) <= 0) return;
    send(client, "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\n\r\n");
    for (int i = 0; !ended_; ++i) {
      const std::string jpeg = jpeg_(i);
      if (jpeg.empty()) break;
      const std::string head = "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: " + std::to_string(jpeg.size());
      if (!send(client, head + "\r\n\r\n" + jpeg + "\r\n")) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    while (stalls_ && !ended_) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  static bool send(int client, const std::string& bytes) {
    std::size_t sent = 0;
    while (sent < bytes.size()) {
      const ssize_t count = ::send(client, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return false;
      sent += static_cast<std::size_t>(count);
    }
    return true;
  }

  std::function<std::string(int)> jpeg_;
  bool stalls_;
  int listener_, port_ = 0;
  std::atomic<bool> ended_{false};
  std::thread server_;
};

}  // namespace touchstone::test
