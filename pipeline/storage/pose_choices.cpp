#include "pipeline/storage/pose_choices.h"

#include <nlohmann/json.hpp>
#include <system_error>

#include "core/files.h"
#include "core/strict_json.h"
#include "pipeline/storage/transform_json.h"

namespace scanrig {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* kFolder = "choices";
constexpr const char* kFile = "choices.json";
constexpr const char* kChoicesFormat = "scanrig-choices";
constexpr int kChoicesVersion = 1;

std::string text_of(const StoredChoices& stored) {
  auto all = ordered_json::array();
  for (const auto& choice : stored.choices) {
    all.push_back({{"pose1_from_pose2", transform_json(choice.pose1_from_pose2)},
                   {"sentence", choice.sentence},
                   {"has_image", choice.has_image}});
  }
  return ordered_json{{"format", kChoicesFormat},
                      {"version", kChoicesVersion},
                      {"picked", stored.picked},
                      {"choices", std::move(all)}}
             .dump(2) +
         "\n";
}

std::string image_name(int number) { return fmt::format("choice{}.png", number); }

Result<void> write_into(const fs::path& folder, std::span<const PoseChoice> choices) {
  StoredChoices stored;
  std::vector<FileContent> files;
  for (const PoseChoice& choice : choices) {
    stored.choices.push_back({choice.pose1_from_pose2, choice.sentence, !choice.png.empty()});
    if (choice.png.empty()) continue;
    files.push_back({image_name(static_cast<int>(stored.choices.size())), std::as_bytes(std::span(choice.png))});
  }
  const std::string text = text_of(stored);
  files.push_back({kFile, std::as_bytes(std::span(text))});
  return write_files_synced(folder, files);
}

}  // namespace

std::string choices_folder() { return kFolder; }
std::string choices_file() { return fmt::format("{}/{}", kFolder, kFile); }
std::string choice_image(int number) { return fmt::format("{}/{}", kFolder, image_name(number)); }

Result<void> write_choices(const fs::path& scan_folder, std::span<const PoseChoice> choices) {
  const fs::path prepared = scan_folder / fmt::format(".{}.new", kFolder);
  std::error_code ignored;
  fs::remove_all(prepared, ignored);
  auto done = create_directories_synced(prepared);
  if (done) done = write_into(prepared, choices);
  if (done) done = replace_folder(prepared, scan_folder / kFolder);
  if (!done) fs::remove_all(prepared, ignored);
  return done;
}

Result<StoredChoices> read_choices(const fs::path& scan_folder) {
  auto file = JsonFile::read(scan_folder / choices_file(), kChoicesFormat, kChoicesVersion);
  if (!file) return file.error().code == ErrorCode::not_found ? StoredChoices{} : Result<StoredChoices>(pass_on(file));
  StoredChoices stored;
  for (JsonObject& one : file->root().objects("choices")) {
    stored.choices.push_back({one.transform("pose1_from_pose2"), one.text("sentence"), one.flag("has_image")});
    one.close();
  }
  stored.picked = file->root().integer("picked", 0, static_cast<int>(stored.choices.size()));
  if (auto whole = file->finish(); !whole) return pass_on(whole);
  return stored;
}

Result<std::optional<Transform>> picked_motion(const fs::path& scan_folder) {
  const auto stored = read_choices(scan_folder);
  if (!stored) return pass_on(stored);
  if (stored->picked == 0) return std::nullopt;
  return stored->choices[static_cast<std::size_t>(stored->picked) - 1].pose1_from_pose2;
}

Result<void> pick_choice(const fs::path& scan_folder, int number) {
  auto stored = read_choices(scan_folder);
  if (!stored) return pass_on(stored);
  const int count = static_cast<int>(stored->choices.size());
  if (count == 0) {
    return fail(ErrorCode::refused, "pose 2 of this scan does not fit in several ways: there is nothing to choose");
  }
  if (number < 1 || number > count) {
    return fail(ErrorCode::invalid_input, "there is no choice {}: choose 1 to {}", number, count);
  }
  stored->picked = number;
  return write_file_atomically(scan_folder / choices_file(), text_of(*stored));
}

}  // namespace scanrig
