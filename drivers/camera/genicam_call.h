#pragma once

#include <arv.h>

#include <memory>
#include <string>
#include <vector>

#include "core/result.h"

namespace scanrig {

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
template <class T>
using GRef = std::unique_ptr<T, Unref>;

/// A GError as Result; `act` is called with a place for one: attempt("set Gain", [&](GError** e) { ... });
/// Fails with `timeout`, `not_found`, `invalid_input` (a feature that is missing or rejects the value), `io`.
class GenicamCall {
 public:
  explicit GenicamCall(std::string who) : who_(std::move(who)) {}
  template <class Act>
  Result<void> operator()(const std::string& what, Act act) const {
    GError* error = nullptr;
    act(&error);
    return error ? refused(what, error) : Result<void>{};
  }
  [[nodiscard]] const std::string& who() const { return who_; }

 private:
  [[nodiscard]] Result<void> refused(const std::string& what, GError* error) const;

  std::string who_;
};

/// True if the camera has the feature and it can be used now.
bool has_feature(ArvCamera* camera, const char* feature);

/// True if the enumeration has the entry and it can be chosen now.
bool has_entry(ArvCamera* camera, const char* feature, const std::string& entry);

/// Names of the entries that can be chosen now; empty if the camera has no such enumeration.
std::vector<std::string> entries_of(ArvCamera* camera, const char* feature);

/// Reads an enumeration or a text. Fails as GenicamCall.
Result<std::string> read_text(ArvCamera* camera, const char* feature, const GenicamCall& attempt);

/// Make a feature have a value: it is read, written if it differs, and read back. A feature that the camera lacks is
/// left alone by those that end in _if_present. Fail as GenicamCall, with `invalid_input` also when the camera keeps
/// another value.
Result<void> set_text(ArvCamera* camera, const char* feature, const std::string& value, const GenicamCall& attempt);
Result<void> set_whole(ArvCamera* camera, const char* feature, std::int64_t value, const GenicamCall& attempt);
Result<void> set_entry_if_present(ArvCamera* camera, const char* feature, const std::string& entry,
                                  const GenicamCall& attempt);
Result<void> set_flag_if_present(ArvCamera* camera, const char* feature, bool value, const GenicamCall& attempt);
Result<void> set_whole_if_present(ArvCamera* camera, const char* feature, std::int64_t value,
                                  const GenicamCall& attempt);
/// Sets the nearest value that the camera offers; `tolerance`: of the value read back, for cameras that round.
Result<void> set_number_if_present(ArvCamera* camera, const char* feature, double value, double tolerance,
                                   const GenicamCall& attempt);

/// Executes a command. Fails as GenicamCall.
Result<void> execute(ArvCamera* camera, const char* command, const GenicamCall& attempt);

}  // namespace scanrig
