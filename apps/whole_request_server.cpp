#include "apps/whole_request_server.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/error.h"

namespace touchstone::apps {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMostConnections = 256;  // whose requests aren't there yet
constexpr int kMostWaiting = 128;      // requests for workers
constexpr auto kDrain = std::chrono::seconds(1);

int ms_until(Clock::time_point until) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
  return static_cast<int>(std::clamp<std::int64_t>(left, 0, 60'000));
}

/// A request that is there, and a socket for the answer.
class AnswerStream : public httplib::Stream {
 public:
  AnswerStream(int socket, std::string request, Clock::duration patience)
      : socket_(socket), request_(std::move(request)), patience_(patience) {}

  bool is_readable() const override { return true; }
  bool is_writable() const override { return true; }
  ssize_t read(char* to, size_t size) override {
    const std::size_t count = std::min(size, request_.size() - at_);
    std::memcpy(to, request_.data() + at_, count);
    at_ += count;
    return static_cast<ssize_t>(count);
  }
  /// All of it within the patience, or -1.
  ssize_t write(const char* from, size_t size) override {
    const auto until = Clock::now() + patience_;
    std::size_t sent = 0;
    while (sent < size) {
      const ssize_t part = ::send(socket_, from + sent, size - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (part > 0) {
        sent += static_cast<std::size_t>(part);
        continue;
      }
      if (part < 0 && errno == EINTR) continue;
      if (part == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) return -1;
      pollfd ready{socket_, POLLOUT, 0};
      const int left = ms_until(until);
      if (left == 0 || (::poll(&ready, 1, left) < 0 && errno != EINTR)) return -1;
    }
    return static_cast<ssize_t>(size);
  }
  // Nobody here asks who it is.
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return socket_; }

 private:
  int socket_;
  std::string request_;
  std::size_t at_ = 0;
  Clock::duration patience_;
};

const char* reason(int status) {
  switch (status) {
    case 400:
      return "Bad Request";
    case 408:
      return "Request Timeout";
    case 411:
      return "Length Required";
    case 413:
      return "Payload Too Large";
    case 431:
      return "Request Header Fields Too Large";
    default:
      return "Service Unavailable";
  }
}

}  // namespace

/// httplib's acceptor hands each connection to this in place of its workers.
class WholeRequestServer::Door : public httplib::TaskQueue {
 public:
  explicit Door(WholeRequestServer& server) : server_(server) { server_.start(); }
  void enqueue(std::function<void()> take) override { take(); }
  void shutdown() override { server_.stop_all(); }

 private:
  WholeRequestServer& server_;
};

WholeRequestServer::WholeRequestServer(int workers, double patience_s)
    : worker_count_(workers),
      patience_(std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(patience_s))) {
  TS_ASSERT(workers > 0 && patience_s > 0.0);
  new_task_queue = [this] { return new Door(*this); };
}

void WholeRequestServer::start() {
  wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  TS_ASSERT(wake_ >= 0);
  ::listen(svr_sock_, kMostConnections);  // httplib lets 5 wait to be accepted; a sixth tries again after a second
  workers_.emplace(static_cast<std::size_t>(worker_count_));
  collector_ = std::thread([this] { collect(); });
}

void WholeRequestServer::stop_all() {
  stopping_ = true;
  ::eventfd_write(wake_, 1);
  collector_.join();
  take_new();
  for (const Connection& connection : connections_) ::close(connection.socket);
  connections_.clear();
  workers_->shutdown();
  ::close(wake_);
}

bool WholeRequestServer::process_and_close_socket(socket_t socket) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    new_.push_back(socket);
  }
  ::eventfd_write(wake_, 1);
  return true;
}

void WholeRequestServer::take_new() {
  std::vector<int> sockets;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    sockets.swap(new_);
  }
  for (const int socket : sockets) connections_.push_back({socket, Clock::now() + patience_});
}

void WholeRequestServer::collect() {
  std::vector<pollfd> ready;
  while (!stopping_) {
    take_new();
    while (std::ssize(connections_) > kMostConnections) {
      // Who is honest has sent its request long before so many others came.
      refuse(connections_.front(), 503,
             fmt::format("{} connections wait to send a request; no more may", kMostConnections));
      ::close(connections_.front().socket);
      connections_.pop_front();
    }
    ready.assign(1, {wake_, POLLIN, 0});
    auto next = Clock::now() + std::chrono::minutes(1);
    for (const Connection& connection : connections_) {
      ready.push_back({connection.socket, POLLIN, 0});
      next = std::min(next, connection.until);
    }
    if (::poll(ready.data(), ready.size(), ms_until(next)) < 0) continue;
    eventfd_t ignored = 0;
    ::eventfd_read(wake_, &ignored);
    const auto now = Clock::now();
    auto at = ready.begin();
    for (auto connection = connections_.begin(); connection != connections_.end();) {
      bool stays = (++at)->revents == 0 || read_from(*connection);
      if (stays && connection->until <= now) {
        const double patience_s = std::chrono::duration<double>(patience_).count();
        if (!connection->answered) {
          refuse(*connection, 408, fmt::format("the request isn't there as a whole after {:g} s", patience_s));
        }
        ::close(connection->socket);
        stays = false;
      }
      connection = stays ? std::next(connection) : connections_.erase(connection);
    }
  }
}

/// Reads what is there. @returns whether it stays with the collector
bool WholeRequestServer::read_from(Connection& connection) {
  char part[16 * 1024];
  const ssize_t got = ::recv(connection.socket, part, sizeof part, MSG_DONTWAIT);
  if (got < 0 && (errno == EINTR || errno == EAGAIN || errno == EWOULDBLOCK)) return true;
  if (got <= 0) {
    ::close(connection.socket);
    return false;
  }
  if (connection.answered) return true;
  try {
    if (!connection.request.take({part, static_cast<std::size_t>(got)})) return true;
    if (waiting_ >= kMostWaiting) {
      throw Refusal{503, fmt::format("{} requests wait to be answered; no more may", kMostWaiting)};
    }
  } catch (const Refusal& refusal) {
    return refuse(connection, refusal.status, refusal.message);
  }
  hand_over(connection.socket, connection.request.text());
  return false;
}

/// Answers. A socket that is closed while bytes are unread takes the answer with it, so what comes is read for a while.
bool WholeRequestServer::refuse(Connection& connection, int status, const std::string& message) {
  // What isn't UTF-8 of what it sent is replaced.
  const nlohmann::json sentence = {{"error", message}};
  const std::string body = sentence.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + "\n";
  const std::string answer = fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}", status,
      reason(status), body.size(), body);
  if (::send(connection.socket, answer.data(), answer.size(), MSG_NOSIGNAL | MSG_DONTWAIT) < 0) {
    // Who has gone needs no answer; the buffer of one that stays holds it.
  }
  ::shutdown(connection.socket, SHUT_WR);
  connection.answered = true;
  connection.until = Clock::now() + kDrain;
  connection.request = {};
  return true;
}

void WholeRequestServer::hand_over(int socket, std::string request) {
  ++waiting_;
  workers_->enqueue([this, socket, request = std::move(request)]() mutable {
    --waiting_;
    AnswerStream stream(socket, std::move(request), patience_);
    bool closed = false;
    process_request(stream, true, closed, nullptr);
    ::shutdown(socket, SHUT_WR);
    ::close(socket);
  });
}

}  // namespace touchstone::apps
