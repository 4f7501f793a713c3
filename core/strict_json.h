#pragma once

#include <filesystem>
#include <initializer_list>
#include <limits>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "core/transform.h"

namespace scanrig {

/// One object of a JsonFile. The reader must read every key of the object, and every key it reads must be present. The
/// first fault is kept in the file and values returned after it are empty, so a reader reads all keys and checks once.
class JsonObject {
 public:
  JsonObject(const nlohmann::json* value, std::string path, std::optional<Error>* fault);

  [[nodiscard]] bool has(std::string_view key) const;
  double number(std::string_view key, double least = -std::numeric_limits<double>::max(),
                double most = std::numeric_limits<double>::max());
  int integer(std::string_view key, int least, int most);
  bool flag(std::string_view key);
  std::string text(std::string_view key);
  std::string one_of(std::string_view key, std::initializer_list<std::string_view> allowed);
  std::string sha256(std::string_view key);
  std::vector<std::string> texts(std::string_view key);
  std::vector<std::string> sha256s(std::string_view key);
  /// A path that stays inside the folder of the file.
  std::string inner_path(std::string_view key);
  std::vector<double> numbers(std::string_view key);
  JsonObject object(std::string_view key);
  std::vector<JsonObject> objects(std::string_view key);
  /// { "rotation": [[..],[..],[..]], "translation": [..] }, orthonormal to 1e-5, no mirror, translation within 1e5 mm.
  Transform transform(std::string_view key);
  /// A key whose content this reader ignores.
  void ignore(std::string_view key);

  /// Faults a key (or the object, with an empty one) for a reason of the reader.
  void reject(std::string_view key, std::string_view why, ErrorCode code = ErrorCode::invalid_input);
  /// Call last: faults the first key that was not read.
  void close();

 private:
  const nlohmann::json* take(std::string_view key);
  std::optional<double> finite(const nlohmann::json& value, const std::string& where);
  [[nodiscard]] std::string where(std::string_view key) const;
  void reject_at(const std::string& where, std::string_view why, ErrorCode code = ErrorCode::invalid_input);

  const nlohmann::json* value_;  ///< null after a fault
  std::string path_;
  std::optional<Error>* fault_;
  std::vector<std::string> taken_;
};

/// A JSON file of one of the formats of docs/reference/scan-folder.md, read strictly. Errors name the file and the
/// key's path.
class JsonFile {
 public:
  /// Fails with `not_found`, `io`, `invalid_input` (not JSON, another format), `unsupported` (a version newer than this
  /// program).
  static Result<JsonFile> read(const std::filesystem::path& file, std::string_view format, int version) {
    return read(file, format, version, version);
  }
  /// The same for formats whose versions back to `oldest` can still be read.
  static Result<JsonFile> read(const std::filesystem::path& file, std::string_view format, int newest, int oldest);
  /// The same from the file's text.
  static Result<JsonFile> parse(std::string_view text, const std::filesystem::path& file, std::string_view format,
                                int newest, int oldest);
  ~JsonFile();
  JsonFile(JsonFile&&) noexcept;
  JsonFile& operator=(JsonFile&&) noexcept;

  JsonObject& root() { return *root_; }
  [[nodiscard]] const std::string& sha256() const { return sha256_; }
  [[nodiscard]] int version() const { return version_; }
  /// Closes the root and returns the first fault, if any.
  Result<void> finish();

 private:
  JsonFile();
  std::unique_ptr<nlohmann::json> document_;
  std::unique_ptr<std::optional<Error>> fault_;
  std::optional<JsonObject> root_;
  std::string name_;
  std::string sha256_;
  int version_ = 0;
};

}  // namespace scanrig
