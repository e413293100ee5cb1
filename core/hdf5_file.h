#pragma once
// HDF5 files that are the same bytes whenever they hold the same values: no time stamps, fixed format version. Not for
// use from several threads at once (Debian's library has one state for all).

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace touchstone {

/// Gives what is to be held while HDF5 is at work; recursive.
using Hdf5Guard = std::shared_ptr<void> (*)();
/// For a program in which others use HDF5's library beside us, as h5py does in Python: each use of ours is then
/// guarded. Null: none, as it is by itself.
void set_hdf5_guard(Hdf5Guard guard);

/// HDF5's own handle (hid_t), without its header.
using Hdf5Id = std::int64_t;

/// The HDF5 type that holds a C++ one: std::uint8_t, 16, 32, 64, std::int32_t, 64, float, double.
template <typename T>
Hdf5Id hdf5_type();

/// What a dataset holds, written beside it as attributes.
struct Hdf5Description {
  std::string path;     ///< "/wrench"
  std::string unit;     ///< "N", "mm"; "1" for pure numbers
  std::string shape;    ///< names of the axes: "samples x 6"
  std::string frame;    ///< coordinates that vectors are in: "gel"; empty where there are none
  std::string meaning;  ///< one sentence
};

/// Rows of a dataset packed as its chunks are kept (shuffled and deflated): a pure function, for many threads.
std::vector<std::uint8_t> pack_hdf5_row(const void* values, std::size_t bytes, std::size_t item_bytes);

/// Makes a new file in memory and writes it when it's closed. Each function throws Error, naming the file, if it can't
/// do what is asked.
class Hdf5Writer {
 public:
  /// A file without a user block.
  explicit Hdf5Writer(const std::filesystem::path& file);
  /// `user_block` bytes before what HDF5 knows of (0, or a power of 2 from 512 up) are left to the caller, see close.
  Hdf5Writer(const std::filesystem::path& file, std::size_t user_block);
  ~Hdf5Writer();
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  /// Makes a dataset of `rows` rows, each of `row_shape`, chunked by whole rows and compressed.
  template <typename T>
  void add_rows(const Hdf5Description& description, std::int64_t rows, const std::vector<std::int64_t>& row_shape) {
    add_dataset(description, hdf5_type<T>(), sizeof(T), rows, row_shape);
  }
  /// Writes one row of a dataset that add_rows made with the same T. @pre `values` has the row's size
  template <typename T>
  void write_row(const std::string& path, std::int64_t row, std::span<const T> values) {
    write_rows(path, hdf5_type<T>(), row, 1, values.data(), values.size());
  }
  /// Makes a dataset as add_rows does, but with a row a chunk, for write_packed_row.
  template <typename T>
  void add_packed_rows(const Hdf5Description& description, std::int64_t rows,
                       const std::vector<std::int64_t>& row_shape) {
    add_chunked_dataset(description, hdf5_type<T>(), rows, row_shape, 1);
  }
  /// Puts a row as pack_hdf5_row made it into a dataset that add_packed_rows made.
  void write_packed_row(const std::string& path, std::int64_t row, std::span<const std::uint8_t> packed);
  /// Makes and fills a whole dataset: `values` holds `rows` rows of `row_shape`.
  template <typename T>
  void write(const Hdf5Description& description, std::int64_t rows, const std::vector<std::int64_t>& row_shape,
             std::span<const T> values) {
    add_rows<T>(description, rows, row_shape);
    write_rows(description.path, hdf5_type<T>(), 0, rows, values.data(), values.size());
  }
  /// Makes a dataset of numbers that grows by `append`, chunked and compressed.
  template <typename T>
  void add_growing(const Hdf5Description& description) {
    add_growing_dataset(description, hdf5_type<T>(), sizeof(T));
  }
  /// Puts numbers behind those of a dataset that add_growing made with the same T.
  template <typename T>
  void append(const std::string& path, std::span<const T> values) {
    append_numbers(path, hdf5_type<T>(), values.data(), static_cast<std::int64_t>(values.size()));
  }
  /// One whole number, as a dataset without axes.
  void write_number(const Hdf5Description& description, std::int64_t value);
  /// A list of texts, as one dataset of texts of equal length, padded with zeros.
  void write_texts(const Hdf5Description& description, const std::vector<std::string>& texts);
  /// An attribute of the file itself.
  void set_attribute(const std::string& name, const std::string& value);
  void set_attribute(const std::string& name, std::int64_t value);

  /// Writes the file; without this call there is none.
  void close();
  /// `head` is asked, with all of the file but the user block, what stands in that; the rest of it is zeros.
  void close(const std::function<std::string(std::string_view rest)>& head);

 private:
  struct Dataset {
    Hdf5Id id = -1;
    std::vector<std::int64_t> shape;
  };
  /// Makes the groups that the path stands in, where there aren't any yet.
  void make_group_of(const std::string& path);
  void add_dataset(const Hdf5Description& description, Hdf5Id type, std::size_t item_bytes, std::int64_t rows,
                   const std::vector<std::int64_t>& row_shape);
  void add_chunked_dataset(const Hdf5Description& description, Hdf5Id type, std::int64_t rows,
                           const std::vector<std::int64_t>& row_shape, std::int64_t rows_per_chunk);
  void add_growing_dataset(const Hdf5Description& description, Hdf5Id type, std::size_t item_bytes);
  void append_numbers(const std::string& path, Hdf5Id type, const void* values, std::int64_t count);
  void write_rows(const std::string& path, Hdf5Id type, std::int64_t first, std::int64_t count, const void* values,
                  std::size_t size);
  void describe(Hdf5Id object, const Hdf5Description& description);
  void text_attribute(Hdf5Id object, const std::string& name, const std::string& value);
  Hdf5Id check(Hdf5Id id, const char* what) const;
  void check_done(int result, const char* what) const;

  std::string name_;
  Hdf5Id file_ = -1;
  std::map<std::string, Dataset> datasets_;
};

/// A dataset read whole, in row-major order.
template <typename T>
struct Hdf5Array {
  std::vector<std::int64_t> shape;
  std::vector<T> values;
};

/// Reads files of any HDF5 writer. Each function throws Error, naming file and dataset.
class Hdf5Reader {
 public:
  /// Opens the file. @throws Error if it isn't there or isn't HDF5
  explicit Hdf5Reader(const std::filesystem::path& file);
  ~Hdf5Reader();
  Hdf5Reader(const Hdf5Reader&) = delete;
  Hdf5Reader& operator=(const Hdf5Reader&) = delete;

  /// A whole dataset; HDF5 turns its numbers into T.
  template <typename T>
  Hdf5Array<T> read(const std::string& path) const {
    Hdf5Array<T> array;
    std::size_t size = 0;
    array.shape = shape_of(path, size);
    array.values.resize(size);
    read_into(path, hdf5_type<T>(), array.values.data());
    return array;
  }
  /// The rows `first` to `first + count - 1` of a dataset (its first axis). @throws Error also if they aren't there
  template <typename T>
  Hdf5Array<T> read_rows(const std::string& path, std::int64_t first, std::int64_t count) const {
    Hdf5Array<T> array;
    std::size_t size = 0;
    array.shape = shape_of_rows(path, first, count, size);
    array.values.resize(size);
    read_row_part(path, hdf5_type<T>(), first, array.shape, array.values.data());
    return array;
  }
  /// The extents of a dataset's axes.
  std::vector<std::int64_t> extents(const std::string& path) const {
    std::size_t ignored = 0;
    return shape_of(path, ignored);
  }
  /// The one whole number of a dataset.
  std::int64_t read_number(const std::string& path) const;
  /// How many numbers a list of whole numbers of any size holds. @throws Error also if it was packed by a filter that
  /// this machine doesn't have, or if not all of the numbers are in the file
  std::int64_t count_of_whole_numbers(const std::string& path) const;
  /// Goes through all that HDF5 itself keeps of a list of whole numbers (not through the numbers): where damage would
  /// end the process, it does so here. For use within isolated_call.
  void walk_list(const std::string& path) const;
  /// Likewise through what HDF5 keeps of an array of numbers of any shape, of which rows are read later: its first row
  /// is read, too.
  void walk_rows(const std::string& path) const;
  /// Reads into `values` as many numbers of a list as fit, from number `first` on. What T can't hold
  /// becomes the nearest value that it can. @pre they are there
  template <typename T>
  void read_part(const std::string& path, std::int64_t first, std::span<T> values) const {
    read_list_part(path, hdf5_type<T>(), first, static_cast<std::int64_t>(values.size()), values.data());
  }
  /// A list of texts.
  std::vector<std::string> read_texts(const std::string& path) const;
  /// A text attribute of a dataset, or of the file if `path` is "/".
  std::string text_attribute(const std::string& path, const std::string& name) const;
  /// A whole number, likewise.
  std::int64_t integer_attribute(const std::string& path, const std::string& name) const;
  /// Is there a dataset or a group of this path?
  bool has(const std::string& path) const;
  /// Has the dataset, or the file if `path` is "/", this attribute?
  bool has_attribute(const std::string& path, const std::string& name) const;

 private:
  std::vector<std::int64_t> shape_of(const std::string& path, std::size_t& size) const;
  void read_into(const std::string& path, Hdf5Id type, void* values) const;
  std::vector<std::int64_t> shape_of_rows(const std::string& path, std::int64_t first, std::int64_t count,
                                          std::size_t& size) const;
  void read_row_part(const std::string& path, Hdf5Id type, std::int64_t first, const std::vector<std::int64_t>& shape,
                     void* values) const;
  void read_list_part(const std::string& path, Hdf5Id type, std::int64_t first, std::int64_t count, void* values) const;
  void expect_whole_numbers(const std::string& path) const;
  bool is_all_there(const std::string& path, std::size_t count) const;  ///< of a list: its numbers, in the file
  void expect_one_value(Hdf5Id attribute, const std::string& path, const std::string& name) const;

  std::string name_;
  Hdf5Id file_ = -1;
};

/// Calls `read`, which reads `file`, in a process of its own, and forgets what it read. HDF5 1.10 ends the process on
/// some damaged files of the older layouts, which have no checksums (5 of 6000 with 1 to 4 flipped bits), or reads
/// beyond its memory. To be called before a file from outside is read in the same way.
/// @throws Error that `read` threw, or that says that HDF5 didn't come back
void try_hdf5(const std::filesystem::path& file, const std::function<void()>& read);

/// try_hdf5, and then `read` in this process. @returns what it returns @throws Error as try_hdf5
template <typename Read>
auto read_hdf5(const std::filesystem::path& file, const Read& read) {
  try_hdf5(file, [&read] { read(); });
  return read();
}

}  // namespace touchstone
