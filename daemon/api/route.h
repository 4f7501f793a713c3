#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "config/setup/session.h"
#include "core/result.h"
#include "daemon/api/request.h"
#include "daemon/api/roles.h"
#include "daemon/journal/journal.h"
#include "daemon/station/control_loop.h"
#include "pipeline/calibration/placement/placement_aid.h"

namespace scanrig {

enum class Method { get, post, del };
std::string_view to_string(Method method);  ///< "GET", "POST", "DELETE"

/// A file to be sent: already open, so that the checked file is the one sent.
class OpenFile {
 public:
  /// `tag`: another one for other content, as of the header ETag.
  OpenFile(int fd, std::uint64_t size, std::string tag) : fd_(fd), size_(size), tag_(std::move(tag)) {}
  ~OpenFile();
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::string& tag() const { return tag_; }

 private:
  int fd_;
  std::uint64_t size_;
  std::string tag_;
};

/// The events after one of them, for as long as the client stays.
struct EventStream {
  std::string after{};  ///< "LIFE-SEQ"; empty: as the header Last-Event-ID says
  bool beats = false;   ///< an event `beat` every half second, for scripts: comments reach none
};

struct ApiResponse {
  unsigned status = 200;
  std::variant<std::string, std::shared_ptr<OpenFile>, EventStream> body{};
  std::string_view type = "application/json";
  std::string why{};  ///< of an error: its message
  /// Headers beside those that every reply has, or instead of them.
  std::vector<std::pair<std::string_view, std::string>> headers{};
};

struct ServiceStatus;
class Access;
class EventHub;

/// Dependencies of the routes. All of it may be used from any thread.
struct ApiStation {
  ControlLoop& loop;
  std::function<ServiceStatus()> facts;  ///< of the machine and of the API itself; the latest, without waiting
  std::filesystem::path storage{};       ///< absolute; where jobs are kept
  std::function<Result<std::string>(std::string_view side, bool is_middle)> preview_jpeg{};  ///< of "left" or "right"
  std::function<Result<PlacementView>(const AwaitedPlacement&)> look_at_board{};
  std::function<Result<void>()> check_config{};      ///< of the file that the daemon was started with
  std::function<void(ControlLoop::Reply)> reload{};  ///< of it; reads the disk
  std::shared_ptr<config::setup::Session> setup{};   ///< null: there are no devices to lend
  std::function<void(const std::string& who, ControlLoop::Reply)> begin_setup{};
  std::function<void(ControlLoop::Reply)> end_setup{};
  std::function<void(std::function<void()>)> on_worker{};  ///< for work that touches the disk
  /// For work of seconds: one after the other, at low priority; the token when the server ends.
  std::function<void(std::function<void(const std::stop_token&)>)> on_background{};
  EventHub* hub = nullptr;                      ///< never null where a server runs
  Access* access = nullptr;                     ///< likewise
  std::function<std::string()> page_address{};  ///< "http://127.0.0.1:8080"; empty: it is not served
  bool tls = false;                             ///< browsers reach it by https, through a proxy
  bool insecure = false;                        ///< other machines may connect without TLS
  const RecentLog* log = nullptr;               ///< null: there is none
};

using Send = std::function<void(ApiResponse)>;

struct Reply {
  unsigned status = 200;
  std::string_view description;
  std::string_view schema{};  ///< a name in openapi.cpp; empty: not JSON
  std::string_view type = "application/json";
};

inline const RequestField kJobId{.name = "id", .description = "the job", .required = true, .min = 1, .max = 128};
inline constexpr Reply kJobDone{.description = "done, and durable", .schema = "JobDone"};

/// One operation of the API. Dispatch, checks and the OpenAPI document all read only this.
struct Route {
  Method method;
  std::string_view path;  ///< "/api/v1/jobs/{id}"
  Role role;              ///< the lowest sufficient one
  std::string_view description;
  std::vector<RequestField> in_path{}, in_query{}, in_body{};
  Reply reply;
  std::vector<unsigned> errors{};        ///< beside those of every route
  bool slow = false;                     ///< touches the disk: done by a worker, not by an I/O thread
  bool reserved = false;                 ///< served where no seat is free
  bool open = false;                     ///< to anybody: the page itself, and the way in
  bool once = false;                     ///< what it sends is made for this request: no HEAD, no part, no ETag
  std::chrono::seconds reply_timeout{};  ///< for the reply; 0: as in the limits
  /// Calls `send` once, from this thread or, soon, from the control loop's.
  std::function<void(const ApiStation&, const Values&, Send)> handle;
};

/// The job that the value `id` names; null where there is none. Text that cannot be a job's id is stopped here.
std::shared_ptr<const JobInfo> find_job(const ApiStation& station, const Values& values);
ApiResponse no_such_job();

/// HTTP status of an error reply.
unsigned http_status(ErrorCode code);
/// {"error": {"code", "message"}}
ApiResponse error_response(const Error& error);
ApiResponse error_response(unsigned status, const Error& error);

/// Every route of the API, in the order of the OpenAPI document.
std::vector<Route> all_routes();

/// Finds the route of a request and checks all its values.
class Router {
 public:
  explicit Router(std::vector<Route> routes = all_routes());

  /// A request whose path, method, role and parameters are right.
  struct Match {
    const Route* route = nullptr;
    Values values{};
  };
  /// The match, or the error reply: 400, 401 (`role` is nothing and the route is not open), 403, 404, 405.
  [[nodiscard]] tl::expected<Match, ApiResponse> find(std::string_view method, std::string_view target,
                                                      std::optional<Role> role) const;
  /// Reads the body and runs the route; `send` as in Route. 400 for a body that does not fit.
  static void call(Match match, std::string_view body, const ApiStation& station, Send send);

  [[nodiscard]] const std::vector<Route>& routes() const { return routes_; }

 private:
  std::vector<Route> routes_;
  std::vector<std::vector<std::string_view>> paths_;  // of each route, in segments
};

std::vector<Route> station_routes();      ///< status, events, buttons, maintenance, inputs and outputs
std::vector<Route> job_routes();          ///< jobs as they are, their files and models
std::vector<Route> model_routes();        ///< lengths on a model, its deviation from a reference
std::vector<Route> order_routes();        ///< actions on jobs: queued, cancelled, bundled, deleted, ...
std::vector<Route> calibration_routes();  ///< calibrating the rig, and how its board stands
std::vector<Route> setup_routes();        ///< scanrig setup from the page
std::vector<Route> service_routes();      ///< health, metrics, the OpenAPI document
std::vector<Route> page_routes();         ///< the web page, what it starts from, logging in and out

/// The OpenAPI 3.0 document of these routes, as JSON.
std::string openapi_document(const std::vector<Route>& routes);

/// The shapes of the API's replies: a JSON object of OpenAPI 3.0 schemas by name.
extern const char* const kSchemas;
/// Additions that make the schema Job into JobDetail: a JSON merge patch (RFC 7396), but its `required` is added.
extern const char* const kJobDetail;

}  // namespace scanrig
