#include "daemon/api/route.h"

#include <cctype>
#include <nlohmann/json.hpp>
#include <set>

#include "core/version.h"
#include "daemon/api/json_replies.h"

namespace scanrig {
namespace {

using nlohmann::ordered_json;

ordered_json schema_of(const RequestField& field) {
  ordered_json schema;
  switch (field.type) {
    case RequestField::Type::text: schema["type"] = "string"; break;
    case RequestField::Type::flag: schema["type"] = "boolean"; break;
    case RequestField::Type::number: schema["type"] = "number"; break;
    case RequestField::Type::integer: schema["type"] = "integer"; break;
  }
  if (!field.words.empty()) {
    schema["enum"] = field.words;
  } else if (field.type == RequestField::Type::text) {
    schema["minLength"] = static_cast<int>(field.min);
    schema["maxLength"] = static_cast<int>(field.max);
  } else if (field.type != RequestField::Type::flag) {
    schema["minimum"] = field.min;
    schema["maximum"] = field.max;
  }
  schema["description"] = field.description;
  return schema;
}

void add_parameters(const std::vector<RequestField>& fields, std::string_view in, ordered_json& parameters) {
  for (const auto& field : fields) {
    parameters.push_back(
        {{"name", field.name}, {"in", in}, {"required", in == "path" || field.required}, {"schema", schema_of(field)}});
  }
}

ordered_json body_of(const std::vector<RequestField>& fields) {
  ordered_json schema{{"type", "object"}, {"additionalProperties", false}, {"properties", ordered_json::object()}};
  for (const auto& field : fields) {
    schema["properties"][std::string(field.name)] = schema_of(field);
    if (field.required) schema["required"].push_back(field.name);
  }
  return {{"content", {{"application/json", {{"schema", std::move(schema)}}}}}};
}

ordered_json reference(std::string_view schema) { return {{"$ref", "#/components/schemas/" + std::string(schema)}}; }

std::string_view words_of(unsigned status) {
  switch (status) {
    case 400: return "the request cannot be understood or a value does not fit";
    case 401: return "no token, or none that is known";
    case 403: return "the role is not enough";
    case 404: return "no such thing";
    case 409: return "a rule, or the state of the rig, is against it now";
    case 413: return "the body is too large";
    case 421: return "the header Host holds no name of this rig";
    case 429: return "too many requests";
    case 431: return "the header is too large";
    case 503: return "too many connections, or the service is too busy to reply in time";
    default: return "the disk or the service failed";
  }
}

ordered_json replies_of(const Route& route) {
  ordered_json replies;
  auto& good = replies[std::to_string(route.reply.status)];
  good["description"] = route.reply.description;
  const auto schema = route.reply.schema.empty() ? ordered_json{{"type", "string"}, {"format", "binary"}}
                                                 : reference(route.reply.schema);
  good["content"][std::string(route.reply.type)]["schema"] = schema;
  std::set<unsigned> errors{400, 401, 403, 413, 421, 429, 431, 503};
  errors.insert(route.errors.begin(), route.errors.end());
  if (!route.in_path.empty()) errors.insert(404);
  for (const unsigned status : errors) {
    replies[std::to_string(status)] = {{"description", words_of(status)},
                                       {"content", {{"application/json", {{"schema", reference("Error")}}}}}};
  }
  return replies;
}

std::string lower(std::string_view text) {
  std::string low(text);
  for (auto& c : low) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return low;
}

std::string name_of(const Route& route) {
  std::string name = lower(to_string(route.method));
  for (const char c : route.path) {
    if (c != '{' && c != '}') name += c == '/' || c == '.' ? '_' : c;
  }
  return name;
}

ordered_json schemas() {
  auto all = ordered_json::parse(kSchemas);
  auto more = ordered_json::parse(kJobDetail);
  ordered_json detail = all["Job"];
  for (auto& name : more["required"]) detail["required"].push_back(std::move(name));
  detail["properties"].merge_patch(more["properties"]);
  all["JobDetail"] = std::move(detail);
  return all;
}

}  // namespace

std::string openapi_document(const std::vector<Route>& routes) {
  ordered_json document{
      {"openapi", "3.0.3"},
      {"info",
       {{"title", "scanrig"},
        {"version", kVersion},
        {"description",
         "The API of the rig. x-role: the lowest role a request needs; the roles are viewer, operator, "
         "engineer, each may what those before it may."}}},
      {"servers", {{{"url", "/"}}}},
      {"security", {{{"token", ordered_json::array()}}}}};
  auto& paths = document["paths"];
  for (const auto& route : routes) {
    ordered_json operation{
        {"operationId", name_of(route)}, {"summary", route.description}, {"x-role", to_string(route.role)}};
    ordered_json parameters = ordered_json::array();
    add_parameters(route.in_path, "path", parameters);
    add_parameters(route.in_query, "query", parameters);
    if (!parameters.empty()) operation["parameters"] = std::move(parameters);
    if (route.open) operation["security"] = ordered_json::array();
    if (!route.in_body.empty()) operation["requestBody"] = body_of(route.in_body);
    operation["responses"] = replies_of(route);
    paths[std::string(route.path)][lower(to_string(route.method))] = std::move(operation);
  }
  document["components"]["schemas"] = schemas();
  document["components"]["securitySchemes"]["token"] = {{"type", "http"}, {"scheme", "bearer"}};
  return to_text(document);
}

const char* const kSchemas = R"({
"Error": {"type": "object", "required": ["error"], "additionalProperties": false, "properties": {
  "error": {"$ref": "#/components/schemas/Problem"}}},
"Problem": {"type": "object", "required": ["code", "message"], "additionalProperties": false, "properties": {
  "code": {"type": "string", "description": "one of the error codes of docs/reference/exit-codes.md"},
  "message": {"type": "string", "description": "who, doing what, what happened, what to do"}}},
"MaybeProblem": {"allOf": [{"$ref": "#/components/schemas/Problem"}], "nullable": true},
"Nothing": {"type": "object", "additionalProperties": false, "properties": {}},
"Pressed": {"type": "object", "required": ["job"], "additionalProperties": false, "properties": {
  "job": {"type": "string", "nullable": true, "description": "the active job"}}},
"Stopped": {"type": "object", "required": ["job", "sent", "standstill"], "additionalProperties": false, "properties": {
  "job": {"type": "string", "nullable": true, "description": "the job that was interrupted"},
  "sent": {"type": "string", "description": "what was done"},
  "standstill": {"$ref": "#/components/schemas/Standstill"}}},
"Standstill": {"type": "string", "enum": ["confirmed", "pending", "moving", "unknown"],
  "description": "pending: stop was sent and is not confirmed yet; unknown: the table may be moving"},
"Status": {"type": "object", "additionalProperties": false,
  "required": ["revision", "machine", "activity", "may_be_moving", "standstill", "cause", "sentence", "next_action", "tone", "word", "actions", "devices", "job",
  "not_started", "queue", "not_begun", "last_order"],
  "properties": {
  "revision": {"type": "integer"},
  "machine": {"type": "string", "description": "in the words of OPC 40100-1, such as Operational.Ready"},
  "activity": {"type": "string", "description": "what the rig is busy with inside that state"},
  "may_be_moving": {"type": "boolean"},
  "standstill": {"$ref": "#/components/schemas/Standstill"},
  "cause": {"type": "string", "description": "why the machine is in this state"},
  "sentence": {"type": "string", "description": "what is going on"},
  "next_action": {"type": "string", "description": "what the operator should do, if only to wait"},
  "tone": {"type": "string", "enum": ["idle", "ready", "working", "act", "fault"], "description": "how urgent it is to a person"},
  "word": {"type": "string", "description": "the state in a word, to be read from afar; of a scan the view: 5/8"},
  "actions": {"type": "object", "additionalProperties": false, "required": ["start", "stop", "reset"],
    "description": "what would be obeyed now from here; a role may forbid it besides", "properties": {
    "start": {"allOf": [{"$ref": "#/components/schemas/Action"}]},
    "stop": {"$ref": "#/components/schemas/Action"}, "reset": {"$ref": "#/components/schemas/Action"}}},
  "devices": {"type": "array", "items": {"$ref": "#/components/schemas/Device"}},
  "job": {"type": "string", "nullable": true, "description": "the active job"},
  "not_started": {"allOf": [{"$ref": "#/components/schemas/NotStarted"}], "nullable": true},
  "not_begun": {"allOf": [{"$ref": "#/components/schemas/NotStarted"}], "nullable": true, "deprecated": true, "description": "old name of not_started"},
  "queue": {"type": "array", "items": {"type": "string"}, "description": "jobs to come, the next one first"},
  "last_order": {"allOf": [{"$ref": "#/components/schemas/LastOrder"}], "nullable": true}}},
"LastOrder": {"type": "object", "required": ["what", "who", "when"], "additionalProperties": false,
  "description": "to the rig, that was obeyed since the service started", "properties": {
  "what": {"type": "string", "description": "start, stop, reset, or what of maintenance"},
  "who": {"type": "string", "description": "panel, the name of a token, a user of this machine, or an address"},
  "when": {"type": "string"}}},
"Action": {"type": "object", "additionalProperties": false, "required": ["ok", "why"], "properties": {
  "ok": {"type": "boolean"}, "why": {"type": "string", "nullable": true, "description": "why it would be refused"},
  "does": {"type": "string", "enum": ["begin", "continue"], "description": "only of start"},
  "offer": {"type": "string", "description": "only of start: what it means now, for POST start"}}},
"NotStarted": {"type": "object", "required": ["job", "why"], "additionalProperties": false,
  "description": "the job that the last Start did not begin; null: it began one", "properties": {
  "job": {"type": "string"}, "why": {"$ref": "#/components/schemas/Problem"}}},
"Device": {"type": "object", "required": ["name", "ok", "problem"], "additionalProperties": false, "properties": {
  "name": {"type": "string"}, "ok": {"type": "boolean"}, "problem": {"$ref": "#/components/schemas/MaybeProblem"}}},
"Io": {"type": "object", "required": ["inputs", "outputs"], "additionalProperties": false, "properties": {
  "inputs": {"type": "object", "additionalProperties": {"type": "boolean"}},
  "outputs": {"type": "object", "additionalProperties": {"type": "boolean"}}}},
"Job": {"type": "object", "additionalProperties": false,
  "required": ["id", "state", "sentence", "next_action", "recipe", "part", "folder", "poses", "views", "stored", "resumable", "quarantined",
  "exported", "passed", "model", "report", "remarks", "config_sha256", "error", "kind", "all_views"], "properties": {
  "kind": {"type": "string", "enum": ["scan", "calibration", "check"]},
  "all_views": {"type": "integer", "description": "of all poses"},
  "id": {"type": "string"}, "state": {"type": "string"},
  "sentence": {"type": "string", "description": "what becomes of it, and why"},
  "next_action": {"type": "string", "description": "what the operator should do, if only to wait"},
  "recipe": {"type": "string"}, "part": {"type": "string", "description": "of the order: barcode or free text"},
  "resumable": {"type": "boolean", "description": "interrupted, and the missing views may still be taken"},
  "quarantined": {"type": "boolean", "description": "two daemons died over its reconstruction"},
  "exported": {"type": "boolean"},
  "passed": {"type": "boolean", "nullable": true, "description": "done: within the limits of its recipe"},
  "folder": {"type": "string"},
  "poses": {"type": "integer", "description": "of a calibration: placements"},
  "views": {"type": "integer", "description": "a pose; a flat placement of a calibration has one more"},
  "stored": {"type": "integer", "description": "views that survive a power cut"},
  "model": {"type": "string", "description": "path of the model; empty until it is there"},
  "report": {"type": "string"},
  "remarks": {"type": "array", "items": {"type": "string"}, "description": "done: that the rig has moved since its calibration, images that the others contradict, a symmetric part, a pose that is known badly"},
  "config_sha256": {"type": "array", "items": {"type": "string"},
    "description": "SHA-256 of each rig.toml that its views were taken under; of a rig without one none"},
  "error": {"$ref": "#/components/schemas/MaybeProblem"}}},
"JobPage": {"type": "object", "required": ["jobs", "next"], "additionalProperties": false, "properties": {
  "jobs": {"type": "array", "items": {"$ref": "#/components/schemas/Job"}},
  "next": {"type": "string", "nullable": true, "description": "`before` of the next page; null on the last"}}},
"StoredView": {"type": "object", "additionalProperties": false,
  "description": "redone and spoilt are old names of retakes and retake_reasons", "required": ["pose", "view", "measured_deg", "error_deg", "settling_ms", "retakes", "retake_reasons", "redone", "spoilt"], "properties": {
  "pose": {"type": "integer"}, "view": {"type": "integer"}, "measured_deg": {"type": "number"},
  "error_deg": {"type": "number", "description": "measured less commanded"}, "settling_ms": {"type": "number"},
  "problems": {"type": "array", "items": {"type": "string"}, "description": "only of a calibration: what is wrong with its images"},
  "retakes": {"type": "integer", "description": "exposures that were lost or unusable and taken again"},
  "redone": {"type": "integer", "deprecated": true, "description": "old name of retakes"},
  "retake_reasons": {"type": "array", "items": {"$ref": "#/components/schemas/Problem"}, "description": "what was wrong with each"},
  "spoilt": {"type": "array", "items": {"$ref": "#/components/schemas/Problem"}, "deprecated": true, "description": "old name of retake_reasons"}}},
"MovementCheck": {"type": "object", "additionalProperties": false,
  "description": "redone and spoilt are old names of retakes and retake_reasons", "required": ["pose", "shift_px", "changed", "unmoved", "retakes", "retake_reasons", "redone", "spoilt"],
  "description": "view 0, taken again, against the first one", "properties": {
  "pose": {"type": "integer"}, "shift_px": {"type": "number"}, "changed": {"type": "number"},
  "unmoved": {"type": "boolean"},
  "retakes": {"type": "integer", "description": "exposures that were lost or unusable and taken again"},
  "redone": {"type": "integer", "deprecated": true, "description": "old name of retakes"},
  "retake_reasons": {"type": "array", "items": {"$ref": "#/components/schemas/Problem"}, "description": "what was wrong with each"},
  "spoilt": {"type": "array", "items": {"$ref": "#/components/schemas/Problem"}, "deprecated": true, "description": "old name of retake_reasons"}}},
"Stage": {"type": "object", "required": ["name", "fraction"], "additionalProperties": false, "properties": {
  "name": {"type": "string"}, "fraction": {"type": "number", "minimum": 0, "maximum": 1}}},
"JobDone": {"type": "object", "required": ["job"], "additionalProperties": false, "properties": {
  "job": {"type": "string"}}},
"FileList": {"type": "object", "required": ["files"], "additionalProperties": false, "properties": {
  "files": {"type": "array", "items": {"type": "object", "required": ["path", "bytes", "type"],
    "additionalProperties": false, "properties": {
    "path": {"type": "string"}, "bytes": {"type": "integer"}, "type": {"type": "string"}}}}}},
"Length": {"type": "object", "required": ["mm", "expanded_uncertainty_mm", "from", "to"], "additionalProperties": false, "properties": {
  "mm": {"type": "number"},
  "expanded_uncertainty_mm": {"type": "number", "nullable": true, "description": "k = 2; null: an end is not measured, or the calibration does not say"},
  "from": {"$ref": "#/components/schemas/RulerEnd"}, "to": {"$ref": "#/components/schemas/RulerEnd"}}},
"RulerEnd": {"type": "object", "required": ["point", "measured", "sigma_mm"], "additionalProperties": false, "properties": {
  "point": {"type": "array", "items": {"type": "number"}, "description": "mm, on the surface"},
  "measured": {"type": "boolean", "description": "false: closed there by silhouettes or the table"},
  "sigma_mm": {"type": "number", "nullable": true}}},
"Deviation": {"type": "object", "additionalProperties": false, "required": ["reference", "model_file", "values_file", "vertices",
  "confirmed", "fits_otherwise", "known_share", "mean_mm", "rms_mm", "p95_mm", "min_mm", "max_mm"], "properties": {
  "reference": {"type": "string"},
  "model_file": {"type": "string", "description": "of the job: the glTF file whose vertices are compared"},
  "values_file": {"type": "string", "description": "of the job: a number per vertex, 16 bit, little-endian, signed, um; positive: outside the reference; -32768: not known"},
  "vertices": {"type": "integer"},
  "confirmed": {"type": "number", "description": "share of the measured surface that lies at the reference"},
  "fits_otherwise": {"type": "boolean", "description": "another way to lay it fits as well: the part is symmetric"},
  "known_share": {"type": "number"}, "mean_mm": {"type": "number"}, "rms_mm": {"type": "number"},
  "p95_mm": {"type": "number", "description": "of the absolute values"}, "min_mm": {"type": "number"}, "max_mm": {"type": "number"}}},
"References": {"type": "object", "required": ["references"], "additionalProperties": false, "properties": {
  "references": {"type": "array", "items": {"type": "object", "required": ["name", "bytes"], "additionalProperties": false, "properties": {
    "name": {"type": "string"}, "bytes": {"type": "integer"}}}}}},
"Report": {"type": "object", "description": "report.json of the model"},
"Calibration": {"type": "object", "required": ["job", "reminder", "awaited_placement", "board"], "additionalProperties": false, "properties": {
  "job": {"allOf": [{"$ref": "#/components/schemas/CalibrationJob"}], "nullable": true},
  "reminder": {"type": "string", "nullable": true, "description": "that the rig's calibration is old"},
  "awaited_placement": {"type": "integer", "nullable": true, "description": "of the plan, that the next Start begins"},
  "board": {"allOf": [{"$ref": "#/components/schemas/BoardOnTable"}], "nullable": true}}},
"CalibrationJob": {"type": "object", "additionalProperties": false,
  "required": ["id", "state", "sentence", "next_action", "placements_complete", "plan", "views", "verdict", "grade", "sentences", "accepted"], "properties": {
  "id": {"type": "string"}, "state": {"type": "string"}, "sentence": {"type": "string"}, "next_action": {"type": "string"},
  "placements_complete": {"type": "integer"},
  "plan": {"type": "array", "items": {"$ref": "#/components/schemas/Placement"}},
  "views": {"type": "array", "items": {"type": "object", "required": ["placement", "view", "table_deg", "examined", "problems"],
    "additionalProperties": false, "properties": {
    "placement": {"type": "integer"}, "view": {"type": "integer"}, "table_deg": {"type": "number"},
    "examined": {"type": "boolean"}, "problems": {"type": "array", "items": {"type": "string"}}}}},
  "verdict": {"type": "string", "enum": ["holds", "moved", "calibrate"], "nullable": true, "description": "of a check, once it is done; moved: its new poses can be accepted"},
  "grade": {"type": "string", "nullable": true, "description": "A, B or C, once it is solved"},
  "sentences": {"type": "array", "items": {"type": "string"}},
  "accepted": {"type": "boolean", "description": "it became the rig's"}}},
"Placement": {"type": "object", "additionalProperties": false,
  "required": ["number", "sets", "portrait", "tilt_deg", "front_mm", "on_block", "mark_deg", "instruction"], "properties": {
  "number": {"type": "integer"}, "sets": {"type": "string"}, "portrait": {"type": "boolean"},
  "tilt_deg": {"type": "number", "description": "from flat"},
  "front_mm": {"type": "number", "description": "of the centre before the axis; negative: behind"},
  "on_block": {"type": "boolean"}, "mark_deg": {"type": "number"}, "instruction": {"type": "string"}}},
"BoardOnTable": {"type": "object", "additionalProperties": false,
  "required": ["sentence", "accepted", "off_deg", "off_mm", "left", "right"], "properties": {
  "sentence": {"type": "string"}, "accepted": {"type": "boolean"},
  "off_deg": {"type": "number", "nullable": true}, "off_mm": {"type": "number", "nullable": true},
  "left": {"$ref": "#/components/schemas/BoardInImage"}, "right": {"$ref": "#/components/schemas/BoardInImage"}}},
"BoardInImage": {"type": "object", "required": ["seen", "problem", "outline", "expected"], "additionalProperties": false, "properties": {
  "seen": {"type": "boolean"}, "problem": {"type": "string", "nullable": true},
  "outline": {"type": "array", "items": {"type": "array", "items": {"type": "number"}}, "description": "pixels; empty: unknown"},
  "expected": {"type": "array", "items": {"type": "array", "items": {"type": "number"}}, "description": "as planned, by the present calibration"}}},
"Health": {"type": "object", "additionalProperties": false,
  "required": ["ok", "problems", "reminders", "version", "uptime_s", "devices", "disk", "temperatures", "deadlines_missed", "retakes",
  "retries", "faults", "connections", "event_streams"], "properties": {
  "ok": {"type": "boolean", "description": "nothing is wrong"},
  "problems": {"type": "array", "items": {"$ref": "#/components/schemas/Problem"}},
  "reminders": {"type": "array", "items": {"type": "string"}, "description": "what is due, although nothing is wrong"},
  "version": {"type": "string"}, "uptime_s": {"type": "number"},
  "devices": {"type": "array", "items": {"$ref": "#/components/schemas/Device"}},
  "disk": {"type": "object", "required": ["bytes", "free_bytes"], "additionalProperties": false, "properties": {
    "bytes": {"type": "integer"}, "free_bytes": {"type": "integer"}}},
  "temperatures": {"type": "array", "items": {"type": "object", "required": ["sensor", "celsius"],
    "additionalProperties": false, "properties": {"sensor": {"type": "string"}, "celsius": {"type": "number"}}}},
  "deadlines_missed": {"type": "integer"}, "retakes": {"type": "integer"},
  "retries": {"type": "integer", "deprecated": true, "description": "old name of retakes"}, "faults": {"type": "integer"},
  "connections": {"type": "integer"}, "event_streams": {"type": "integer"}}},
"Doctor": {"type": "object", "required": ["time", "findings"], "additionalProperties": false, "properties": {
  "time": {"type": "string", "nullable": true},
  "findings": {"type": "array", "items": {"$ref": "#/components/schemas/Finding"}}}},
"Finding": {"type": "object", "required": ["id", "problem", "remedy"], "additionalProperties": false, "properties": {
  "id": {"type": "string", "description": "one word for programs, see the doctor's README"},
  "problem": {"type": "string"}, "remedy": {"type": "string"}}},
"Login": {"type": "object", "required": ["role", "name", "cookie"], "additionalProperties": false, "properties": {
  "role": {"type": "string", "enum": ["viewer", "operator", "engineer"]},
  "name": {"type": "string", "nullable": true, "description": "of the token; null: a user of this machine, or a code from one"},
  "cookie": {"type": "boolean", "description": "known by the cookie of a login"}}},
"LoginCode": {"type": "object", "required": ["code", "valid_s", "address"], "additionalProperties": false, "properties": {
  "code": {"type": "string"}, "valid_s": {"type": "integer"},
  "address": {"type": "string", "nullable": true, "description": "of the page; null: it is not served, [api] http_port is not set"}}},
"Page": {"type": "object", "required": ["life", "seq", "time", "build", "status", "jobs", "health", "login", "insecure"], "additionalProperties": false, "properties": {
  "life": {"type": "string", "description": "of this run of the service"},
  "seq": {"type": "integer", "description": "the newest event that is in it"},
  "time": {"type": "string"}, "build": {"type": "string", "description": "of the page: another one, and a page loads itself again"},
  "status": {"$ref": "#/components/schemas/Status"},
  "jobs": {"type": "array", "items": {"$ref": "#/components/schemas/JobDetail"}},
  "health": {"$ref": "#/components/schemas/Health"},
  "login": {"$ref": "#/components/schemas/Login"},
  "insecure": {"type": "boolean", "description": "other machines may send tokens in the clear: insecure_http"}}},
"Log": {"type": "object", "required": ["lines"], "additionalProperties": false, "properties": {"lines": {"type": "array",
  "items": {"type": "object", "required": ["number", "time", "priority", "job", "device", "message"], "additionalProperties": false, "properties": {
    "number": {"type": "integer", "description": "in the order written"}, "time": {"type": "string"},
    "priority": {"type": "string", "enum": ["error", "warning", "notice", "info"]},
    "job": {"type": "string", "description": "empty: of no job"}, "device": {"type": "string", "description": "empty: of no device"},
    "message": {"type": "string"}}}}}},
"Recipes": {"type": "object", "required": ["recipes"], "additionalProperties": false, "properties": {"recipes": {"type": "array",
  "items": {"type": "object", "required": ["name", "poses", "views"], "additionalProperties": false, "properties": {
    "name": {"type": "string"}, "poses": {"type": "integer"}, "views": {"type": "integer", "description": "of each pose"}}}}}},
"ConfigCheck": {"type": "object", "required": ["ok", "problems"], "additionalProperties": false, "properties": {
  "ok": {"type": "boolean"}, "problems": {"type": "array", "items": {"type": "string"}}}},
"Setup": {"type": "object", "required": ["phase", "who", "owner", "refused", "told", "question", "draft", "problem"], "additionalProperties": false, "properties": {
  "phase": {"type": "string", "enum": ["none", "lending", "working", "found", "written", "examined", "failed"]},
  "who": {"type": "string", "nullable": true, "description": "who began it"},
  "owner": {"type": "boolean", "description": "the key was the owner's: it may reply"},
  "refused": {"type": "string", "nullable": true, "description": "why it could not begin now"},
  "told": {"type": "array", "items": {"type": "string"}, "description": "what was found, and what to do"},
  "question": {"allOf": [{"$ref": "#/components/schemas/SetupQuestion"}], "nullable": true},
  "draft": {"type": "string", "nullable": true, "description": "text of the rig.toml that was found; for the owner"},
  "problem": {"type": "string", "nullable": true, "description": "why it failed"}}},
"SetupQuestion": {"type": "object", "required": ["number", "kind", "text", "min", "max", "options"], "additionalProperties": false, "properties": {
  "number": {"type": "integer"},
  "kind": {"type": "string", "enum": ["yes_or_no", "number", "choice", "done"]},
  "text": {"type": "string"}, "min": {"type": "number"}, "max": {"type": "number"},
  "options": {"type": "array", "items": {"$ref": "#/components/schemas/SetupOption"}}}},
"SetupOption": {"type": "object", "required": ["text", "image"], "additionalProperties": false, "properties": {
  "text": {"type": "string"}, "image": {"type": "boolean", "description": "GET setup/image/{option} has one"}}},
"SetupKey": {"type": "object", "required": ["key"], "additionalProperties": false, "properties": {"key": {"type": "string"}}},
"Suggestion": {"type": "object", "required": ["number", "sentence", "doubt", "gain", "unseen_after", "overlap", "image"], "additionalProperties": false, "properties": {
  "number": {"type": "integer", "description": "from 1"},
  "sentence": {"type": "string", "description": "for the operator: how to lay it down, and what that shows"},
  "doubt": {"type": "string", "description": "why its pose may not be found; empty: it can be"},
  "gain": {"type": "number", "description": "share of the unseen surface that it is expected to show"},
  "unseen_after": {"type": "number", "description": "share of all surface that would stay unseen"},
  "overlap": {"type": "number", "description": "share of the surface seen that both poses would see"},
  "image": {"type": "boolean", "description": "GET suggestions/{number} has one"}}},
"Choice": {"type": "object", "required": ["number", "sentence", "image", "picked"], "additionalProperties": false, "properties": {
  "number": {"type": "integer", "description": "from 1"},
  "sentence": {"type": "string", "description": "how pose 2 would lie, and how well it fits"},
  "image": {"type": "string", "description": "a file of the job: the part from the front and from behind; empty: not drawn"},
  "picked": {"type": "boolean", "description": "by the operator"}}},
"OpenApi": {"type": "object", "required": ["openapi", "paths"]}
})";

const char* const kJobDetail = R"({
"description": "closures is the old name of movement_checks", "required": ["movement_checks", "closures", "stages", "live", "suggestions", "choices"],
"properties": {
  "stored": {"type": "array", "description": null, "items": {"$ref": "#/components/schemas/StoredView"}},
  "movement_checks": {"type": "array", "items": {"$ref": "#/components/schemas/MovementCheck"}},
  "closures": {"type": "array", "items": {"$ref": "#/components/schemas/MovementCheck"}, "deprecated": true, "description": "old name of movement_checks"},
  "stages": {"type": "array", "items": {"$ref": "#/components/schemas/Stage"}},
  "live": {"type": "array", "items": {"type": "string"}, "description": "what the scan shows so far: files live/NAME.glb of the job, which never change"},
  "suggestions": {"type": "array", "items": {"$ref": "#/components/schemas/Suggestion"}, "description": "how the part can lie in the next pose, best first, until the model is made; empty: not known"},
  "choices": {"type": "array", "items": {"$ref": "#/components/schemas/Choice"}, "description": "where pose 2 fits in several ways that give different surfaces: the operator picks one; best first"}}})";

}  // namespace scanrig
