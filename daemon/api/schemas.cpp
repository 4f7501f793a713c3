#include "daemon/api/schemas.h"

namespace scanrig {

const char* const kSchemas = R"({
"Error": {"type": "object", "required": ["error"], "additionalProperties": false, "properties": {
  "error": {"$ref": "#/components/schemas/Problem"}}},
"Problem": {"type": "object", "required": ["code", "message"], "additionalProperties": false, "properties": {
  "code": {"type": "string", "description": "one of the error codes of docs/reference/exit-codes.md"},
  "message": {"type": "string", "description": "who, doing what, what happened, what to do"}}},
"MaybeProblem": {"allOf": [{"$ref": "#/components/schemas/Problem"}], "nullable": true},
"Nothing": {"type": "object", "additionalProperties": false, "properties": {}},
"Pressed": {"type": "object", "required": ["job"], "additionalProperties": false, "properties": {
  "job": {"type": "string", "nullable": true, "description": "the job that has the rig now"}}},
"Stopped": {"type": "object", "required": ["job", "sent", "standstill"], "additionalProperties": false, "properties": {
  "job": {"type": "string", "nullable": true, "description": "the job that was interrupted"},
  "sent": {"type": "string", "description": "what was done"},
  "standstill": {"$ref": "#/components/schemas/Standstill"}}},
"Standstill": {"type": "string", "enum": ["confirmed", "pending", "moving", "unknown"],
  "description": "pending: stop was sent and is not confirmed yet; unknown: the table may be moving"},
"Status": {"type": "object", "additionalProperties": false,
  "required": ["revision", "machine", "activity", "may_be_moving", "standstill", "cause", "sentence", "next_action", "devices", "job",
  "not_started", "queue", "not_begun"],
  "properties": {
  "revision": {"type": "integer"},
  "machine": {"type": "string", "description": "in the words of OPC 40100-1, such as Operational.Ready"},
  "activity": {"type": "string", "description": "what the rig is busy with inside that state"},
  "may_be_moving": {"type": "boolean"},
  "standstill": {"$ref": "#/components/schemas/Standstill"},
  "cause": {"type": "string", "description": "why the machine is in this state"},
  "sentence": {"type": "string", "description": "what is going on"},
  "next_action": {"type": "string", "description": "what the operator should do, if only to wait"},
  "devices": {"type": "array", "items": {"$ref": "#/components/schemas/Device"}},
  "job": {"type": "string", "nullable": true, "description": "the job that has the rig"},
  "not_started": {"allOf": [{"$ref": "#/components/schemas/NotStarted"}], "nullable": true},
  "not_begun": {"allOf": [{"$ref": "#/components/schemas/NotStarted"}], "nullable": true, "deprecated": true, "description": "old name of not_started"},
  "queue": {"type": "array", "items": {"type": "string"}, "description": "jobs to come, the next one first"}}},
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
  "exported", "passed", "model", "report", "config_sha256", "error"], "properties": {
  "id": {"type": "string"}, "state": {"type": "string"},
  "sentence": {"type": "string", "description": "what becomes of it, and why"},
  "next_action": {"type": "string", "description": "what the operator should do, if only to wait"},
  "recipe": {"type": "string"}, "part": {"type": "string", "description": "of the order: barcode or free text"},
  "resumable": {"type": "boolean", "description": "interrupted, and the missing views may still be taken"},
  "quarantined": {"type": "boolean", "description": "two daemons died over its reconstruction"},
  "exported": {"type": "boolean"},
  "passed": {"type": "boolean", "nullable": true, "description": "done: within the limits of its recipe"},
  "folder": {"type": "string"},
  "poses": {"type": "integer"}, "views": {"type": "integer", "description": "a pose"},
  "stored": {"type": "integer", "description": "views that survive a power cut"},
  "model": {"type": "string", "description": "path of the model; empty until it is there"},
  "report": {"type": "string"},
  "config_sha256": {"type": "array", "items": {"type": "string"},
    "description": "SHA-256 of each rig.toml that its views were taken under; of a rig without one none"},
  "error": {"$ref": "#/components/schemas/MaybeProblem"}}},
"JobPage": {"type": "object", "required": ["jobs", "next"], "additionalProperties": false, "properties": {
  "jobs": {"type": "array", "items": {"$ref": "#/components/schemas/Job"}},
  "next": {"type": "string", "nullable": true, "description": "`before` of the next page; null on the last"}}},
"StoredView": {"type": "object", "additionalProperties": false,
  "required": ["pose", "view", "measured_deg", "error_deg", "settling_ms", "retakes", "retake_reasons", "redone", "spoilt"], "properties": {
  "pose": {"type": "integer"}, "view": {"type": "integer"}, "measured_deg": {"type": "number"},
  "error_deg": {"type": "number", "description": "measured less commanded"}, "settling_ms": {"type": "number"},
  "retakes": {"type": "integer", "description": "exposures that were lost or unusable and taken again"},
  "redone": {"type": "integer", "deprecated": true, "description": "old name of retakes"},
  "retake_reasons": {"type": "array", "items": {"$ref": "#/components/schemas/Problem"}, "description": "what was wrong with each"},
  "spoilt": {"type": "array", "items": {"$ref": "#/components/schemas/Problem"}, "deprecated": true, "description": "old name of retake_reasons"}}},
"MovementCheck": {"type": "object", "additionalProperties": false,
  "required": ["pose", "shift_px", "changed", "unmoved", "retakes", "retake_reasons", "redone", "spoilt"],
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
"Report": {"type": "object", "description": "report.json of the model"},
"Health": {"type": "object", "additionalProperties": false,
  "required": ["ok", "problems", "version", "uptime_s", "devices", "disk", "temperatures", "deadlines_missed", "retakes",
  "retries", "faults", "connections", "event_streams"], "properties": {
  "ok": {"type": "boolean", "description": "nothing is wrong"},
  "problems": {"type": "array", "items": {"$ref": "#/components/schemas/Problem"}},
  "version": {"type": "string"}, "uptime_s": {"type": "number"},
  "devices": {"type": "array", "items": {"$ref": "#/components/schemas/Device"}},
  "disk": {"type": "object", "required": ["bytes", "free_bytes"], "additionalProperties": false, "properties": {
    "bytes": {"type": "integer"}, "free_bytes": {"type": "integer"}}},
  "temperatures": {"type": "array", "items": {"type": "object", "required": ["sensor", "celsius"],
    "additionalProperties": false, "properties": {"sensor": {"type": "string"}, "celsius": {"type": "number"}}}},
  "deadlines_missed": {"type": "integer"}, "retakes": {"type": "integer"},
  "retries": {"type": "integer", "deprecated": true, "description": "old name of retakes"}, "faults": {"type": "integer"},
  "connections": {"type": "integer"}, "event_streams": {"type": "integer"}}},
"ConfigCheck": {"type": "object", "required": ["ok", "problems"], "additionalProperties": false, "properties": {
  "ok": {"type": "boolean"}, "problems": {"type": "array", "items": {"type": "string"}}}},
"OpenApi": {"type": "object", "required": ["openapi", "paths"]}
})";

const char* const kJobDetail = R"({
"required": ["movement_checks", "closures", "stages"],
"properties": {
  "stored": {"type": "array", "description": null, "items": {"$ref": "#/components/schemas/StoredView"}},
  "movement_checks": {"type": "array", "items": {"$ref": "#/components/schemas/MovementCheck"}},
  "closures": {"type": "array", "items": {"$ref": "#/components/schemas/MovementCheck"}, "deprecated": true, "description": "old name of movement_checks"},
  "stages": {"type": "array", "items": {"$ref": "#/components/schemas/Stage"}}}})";

}  // namespace scanrig
