#pragma once
// Events as text, a line each.

#include <array>
#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/mapped_file.h"
#include "sensors/events/event_check.h"
#include "sensors/events/event_source.h"

namespace touchstone::sensors {

/// Reads lines of time, column, row and polarity (1 ON, 0 or -1 OFF), set apart by blanks, tabs or commas. A line of
/// names (t_us or t_s, x, y, p), a comment or not, says their order and the unit of time. Without one the order is that
/// one, and a time with a decimal point or exponent is in seconds (the layout of [Mueggler2017]), one without in us.
/// Lines of two whole numbers ahead of the events are the camera's width and height; so are comments
/// "# width 346". Other comments (#) and empty lines are passed over.
class TextEventReader {
 public:
  /// Opens the file. @throws Error as EventReader
  TextEventReader(const std::filesystem::path& file, const EventReadOptions& options);

  /// Puts the next portion into `events`, nothing at the end.
  void read(std::vector<Event>& events);
  const EventSource& source() const { return source_; }

 private:
  enum class Column { time, x, y, polarity };
  enum class TimeUnit { unknown, microsecond, second };

  bool read_line(Event& event);
  void read_comment(const char* from, const char* end);
  void read_size(const char* from, const char* end);
  bool take_names(const char* from, const char* end);
  std::int64_t time_of(const char*& at, const char* end);
  [[noreturn]] void refuse(const std::string& what) const;
  void start_events();

  std::string name_;
  MappedFile file_;
  EventReadOptions options_;
  EventSource source_;
  EventCheck check_;
  std::size_t at_ = 0;
  int line_ = 0;
  bool started_ = false;
  std::array<Column, 4> columns_{Column::time, Column::x, Column::y, Column::polarity};
  bool named_ = false;  ///< a line of names has said which column is which
  TimeUnit unit_ = TimeUnit::unknown;
  std::optional<int> width_, height_;
};

/// Writes "t_us x y p", or the same with commas for names that end in .csv, behind comments on program and camera.
class TextEventWriter {
 public:
  /// Begins the file. @throws Error if it can't be written
  TextEventWriter(const std::filesystem::path& file, cv::Size size, const std::string& program);
  /// @pre within the picture, in the order of time
  void append(std::span<const Event> events);
  /// Writes what is left. @throws Error if the file can't be written
  void close();

 private:
  void flush();

  std::string name_;
  std::ofstream out_;
  char separator_;
  std::string buffer_;
};

}  // namespace touchstone::sensors
