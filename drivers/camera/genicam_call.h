#pragma once

#include <arv.h>

#include <memory>
#include <string>

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

/// Sets an enumeration or a text. Fails as GenicamCall.
Result<void> set_text(ArvCamera* camera, const char* feature, const std::string& value, const GenicamCall& attempt);

}  // namespace scanrig
