#include "core/strict_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/files.h"
#include "core/hash.h"

namespace scanrig {

using nlohmann::json;

namespace {

/// Line and column, both from 1, of the byte numbered from 1.
std::pair<std::size_t, std::size_t> line_and_column(std::string_view text, std::size_t byte) {
  const auto before = text.substr(0, byte > 0 ? byte - 1 : 0);
  const auto line_start = before.rfind('\n');
  return {1 + static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n')),
          1 + before.size() - (line_start == std::string_view::npos ? 0 : line_start + 1)};
}

bool is_sha256(std::string_view text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

}  // namespace

JsonObject::JsonObject(const json* value, std::string path, std::optional<Error>* fault)
    : value_(value), path_(std::move(path)), fault_(fault) {}

std::string JsonObject::where(std::string_view key) const {
  if (path_.empty() || key.empty()) return path_ + std::string(key);
  return path_ + "." + std::string(key);
}

void JsonObject::reject_at(const std::string& where, std::string_view why, ErrorCode code) {
  if (!*fault_) *fault_ = Error{code, where.empty() ? std::string(why) : fmt::format("{}: {}", where, why)};
  value_ = nullptr;
}

void JsonObject::reject(std::string_view key, std::string_view why, ErrorCode code) {
  reject_at(where(key), why, code);
}

bool JsonObject::has(std::string_view key) const { return value_ && value_->contains(key); }

const json* JsonObject::take(std::string_view key) {
  taken_.emplace_back(key);
  if (!value_ || *fault_) return nullptr;
  const auto found = value_->find(key);
  if (found == value_->end()) {
    reject(key, "is missing");
    return nullptr;
  }
  return &*found;
}

void JsonObject::ignore(std::string_view key) { taken_.emplace_back(key); }

std::optional<double> JsonObject::finite(const json& value, const std::string& where) {
  if (value.is_number() && std::isfinite(value.get<double>())) return value.get<double>();
  reject_at(where, fmt::format("must be a finite number, not {}", value.type_name()));
  return std::nullopt;
}

double JsonObject::number(std::string_view key, double least, double most) {
  const json* value = take(key);
  if (!value) return 0.0;
  const auto number = finite(*value, where(key));
  if (!number) return 0.0;
  if (*number < least || *number > most) {
    reject(key, fmt::format("{} is not within {} to {}", *number, least, most));
    return 0.0;
  }
  return *number;
}

int JsonObject::integer(std::string_view key, int least, int most) {
  const double value = number(key, least, most);
  if (value != std::floor(value)) reject(key, fmt::format("{} is not a whole number", value));
  return static_cast<int>(value);
}

bool JsonObject::flag(std::string_view key) {
  const json* value = take(key);
  if (!value) return false;
  if (!value->is_boolean()) {
    reject(key, "must be true or false");
    return false;
  }
  return value->get<bool>();
}

std::string JsonObject::text(std::string_view key) {
  const json* value = take(key);
  if (!value) return {};
  if (!value->is_string()) {
    reject(key, "must be a string");
    return {};
  }
  return value->get<std::string>();
}

std::string JsonObject::one_of(std::string_view key, std::initializer_list<std::string_view> allowed) {
  std::string value = text(key);
  if (std::find(allowed.begin(), allowed.end(), value) == allowed.end()) {
    reject(key, fmt::format("\"{}\" is not one of: {}", value, fmt::join(allowed, ", ")));
  }
  return value;
}

std::string JsonObject::sha256(std::string_view key) {
  std::string value = text(key);
  if (!is_sha256(value)) reject(key, "must be 64 lower-case hexadecimal digits");
  return value;
}

std::vector<std::string> JsonObject::texts(std::string_view key) {
  std::vector<std::string> values;
  const json* list = take(key);
  if (!list) return values;
  const bool whole = list->is_array() && std::ranges::all_of(*list, [](const json& item) { return item.is_string(); });
  if (whole) return list->get<std::vector<std::string>>();
  reject(key, "must be a list of texts");
  return values;
}

std::vector<std::string> JsonObject::sha256s(std::string_view key) {
  std::vector<std::string> values;
  const json* list = take(key);
  if (!list) return values;
  for (const json& item : *list) {
    if (!list->is_array() || !item.is_string() || !is_sha256(item.get<std::string>())) break;
    values.push_back(item.get<std::string>());
  }
  if (!list->is_array() || values.size() != list->size()) {
    reject(key, "must be a list of texts of 64 lower-case hexadecimal digits");
  }
  return values;
}

std::string JsonObject::inner_path(std::string_view key) {
  std::string value = text(key);
  const std::filesystem::path path(value);
  const bool inside = !value.empty() && value.find('\0') == std::string::npos && path.is_relative() &&
                      std::find(path.begin(), path.end(), "..") == path.end();
  if (!inside) {
    reject(key, fmt::format("\"{}\" is not a path inside the folder", value));
  }
  return value;
}

std::vector<double> JsonObject::numbers(std::string_view key) {
  std::vector<double> values;
  const json* list = take(key);
  if (!list) return values;
  if (!list->is_array()) {
    reject(key, "must be a list");
    return values;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const auto number = finite((*list)[i], fmt::format("{}[{}]", where(key), i));
    values.push_back(number.value_or(0.0));
  }
  return values;
}

JsonObject JsonObject::object(std::string_view key) {
  const json* value = take(key);
  if (value && !value->is_object()) {
    reject(key, "must be an object");
    value = nullptr;
  }
  return {value, where(key), fault_};
}

std::vector<JsonObject> JsonObject::objects(std::string_view key) {
  std::vector<JsonObject> items;
  const json* list = take(key);
  if (!list) return items;
  if (!list->is_array()) {
    reject(key, "must be a list");
    return items;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string path = fmt::format("{}[{}]", where(key), i);
    if (!(*list)[i].is_object()) reject_at(path, "must be an object");
    items.emplace_back((*list)[i].is_object() ? &(*list)[i] : nullptr, path, fault_);
  }
  return items;
}

Transform JsonObject::transform(std::string_view key) {
  JsonObject object = this->object(key);
  Transform result = Transform::Identity();
  const json* rows = object.take("rotation");
  const std::vector<double> translation = object.numbers("translation");
  object.close();
  if (*fault_ || !rows) return result;
  const std::string name = where(key) + ".rotation";
  bool shaped = rows->is_array() && rows->size() == 3;
  for (const json& row : *rows) shaped = shaped && row.is_array() && row.size() == 3;
  if (!shaped) {
    reject_at(name, "must be three rows of three numbers");
    return result;
  }
  Eigen::Matrix3d rotation;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c)
      rotation(r, c) = finite((*rows)[r][c], fmt::format("{}[{}][{}]", name, r, c)).value_or(0);
  }
  if (*fault_) return result;
  const double error = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error > 1e-5)
    reject_at(name, fmt::format("is not a rotation matrix: its columns are off unit and square by {:.2g}", error));
  else if (rotation.determinant() < 0.0)
    reject_at(name, "is a mirror, not a rotation matrix");
  if (translation.size() != 3 || Eigen::Vector3d(translation[0], translation[1], translation[2]).norm() > 1e5) {
    reject_at(where(key) + ".translation", "must be three numbers, in mm, within 1e5");
  }
  if (*fault_) return result;
  result.linear() = rotation;
  result.translation() = Eigen::Vector3d(translation[0], translation[1], translation[2]);
  return result;
}

void JsonObject::close() {
  if (!value_ || *fault_) return;
  for (const auto& [key, value] : value_->items()) {
    if (std::find(taken_.begin(), taken_.end(), key) == taken_.end()) {
      reject(key, "is not a key of this format");
      return;
    }
  }
}

JsonFile::JsonFile() : document_(std::make_unique<json>()), fault_(std::make_unique<std::optional<Error>>()) {}
JsonFile::~JsonFile() = default;
JsonFile::JsonFile(JsonFile&&) noexcept = default;
JsonFile& JsonFile::operator=(JsonFile&&) noexcept = default;

Result<JsonFile> JsonFile::read(const std::filesystem::path& file, std::string_view format, int newest, int oldest) {
  const auto text = read_file(file);
  if (!text) return pass_on(text);
  return parse(*text, file, format, newest, oldest);
}

Result<JsonFile> JsonFile::parse(std::string_view text, const std::filesystem::path& file, std::string_view format,
                                 int newest, int oldest) {
  JsonFile result;
  result.name_ = file.string();
  result.sha256_ = scanrig::sha256(text);
  try {
    *result.document_ = json::parse(text);
  } catch (const json::parse_error& e) {
    const auto [line, column] = line_and_column(text, e.byte);
    return fail(ErrorCode::invalid_input, "{}:{}:{}: not valid JSON from here on", result.name_, line, column);
  } catch (const json::exception& e) {
    return fail(ErrorCode::invalid_input, "{}: not valid JSON: {}", result.name_, e.what());
  }
  if (!result.document_->is_object()) return fail(ErrorCode::invalid_input, "{}: not a JSON object", result.name_);
  JsonObject& root = result.root_.emplace(result.document_.get(), "", result.fault_.get());
  root.one_of("format", {format});
  result.version_ = root.integer("version", 1, 1'000'000);
  if (result.version_ < oldest || result.version_ > newest) {
    root.reject("version", fmt::format("{} is not supported, only up to {}", result.version_, newest),
                ErrorCode::unsupported);
  }
  if (*result.fault_) return tl::unexpected<Error>((*result.fault_)->in(result.name_));
  return result;
}

Result<void> JsonFile::finish() {
  root_->close();
  if (*fault_) return tl::unexpected<Error>((*fault_)->in(name_));
  return {};
}

}  // namespace scanrig
