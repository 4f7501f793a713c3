#include "sim/wire/gige_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace scanrig::sim::wire {
namespace {

using Kind = GigeFeature::Kind;
using Entries = std::vector<std::pair<std::string, std::uint32_t>>;

Entries numbered(const std::vector<std::string>& names) {
  Entries entries;
  for (const std::string& name : names) entries.emplace_back(name, static_cast<std::uint32_t>(entries.size()));
  return entries;
}

class FeatureList {
 public:
  GigeFeature& add(const std::string& name, Kind kind, double standard, double low, double high) {
    GigeFeature feature;
    feature.name = name;
    feature.kind = kind;
    feature.standard = standard;
    feature.low = low;
    feature.high = high;
    return all.emplace_back(std::move(feature));
  }
  GigeFeature& choice(const std::string& name, const std::vector<std::string>& names, double standard = 0) {
    GigeFeature& feature = add(name, Kind::choice, standard, 0, 0);
    feature.entries = numbered(names);
    return feature;
  }
  GigeFeature& flag(const std::string& name, bool standard = false) {
    return add(name, Kind::boolean, standard ? 1 : 0, 0, 1);
  }
  GigeFeature& computed(const std::string& name) { return add(name, Kind::computed, 0, 0, 0); }
  GigeFeature& command(const std::string& name) { return add(name, Kind::command, 0, 0, 1); }
  /// The features from `first` on have one value for each entry of `selector`, or are locked.
  void select(std::size_t first, const std::string& selector) {
    for (std::size_t i = first; i < all.size(); ++i) all[i].selector = selector;
  }
  void lock(std::size_t first) {
    for (std::size_t i = first; i < all.size(); ++i) all[i].is_locked = true;
  }

  std::vector<GigeFeature> all;
};

void add_format(FeatureList& list, const GigeModel& model) {
  list.computed("WidthMax");
  list.computed("HeightMax");
  list.computed("OffsetXMax");
  list.computed("OffsetYMax");
  list.computed("PayloadSize");
  const std::size_t first = list.all.size();
  list.add("Width", Kind::integer, model.sensor.width, 16, model.sensor.width).limit = "WidthMax";
  list.add("Height", Kind::integer, model.sensor.height, 16, model.sensor.height).limit = "HeightMax";
  list.add("OffsetX", Kind::integer, 0, 0, model.sensor.width - 16).limit = "OffsetXMax";
  list.add("OffsetY", Kind::integer, 0, 0, model.sensor.height - 16).limit = "OffsetYMax";
  for (const char* name : {"BinningHorizontal", "BinningVertical", "DecimationHorizontal", "DecimationVertical"}) {
    list.add(name, Kind::integer, 1, 1, 4);
  }
  list.flag("ReverseX");
  list.flag("ReverseY");
  list.choice("PixelFormat", {}, 0x01080001).entries = {
      {"Mono8", 0x01080001},    {"Mono10", 0x01100003},   {"Mono12", 0x01100005},   {"Mono16", 0x01100007},
      {"BayerGR8", 0x01080008}, {"BayerRG8", 0x01080009}, {"BayerGB8", 0x0108000A}, {"BayerBG8", 0x0108000B},
      {"RGB8", 0x02180014},     {"BGR8", 0x02180015}};  // Pixel Format Naming Convention
  list.flag("ChunkModeActive");
  list.lock(first);
  list.choice("TestPattern", {"Off", "GreyHorizontalRamp", "GreyVerticalRamp"});
}

/// Triggers that come before a frame's own, which is the last of the list.
std::vector<std::string> triggers_of(const std::string& frame_trigger) {
  std::vector<std::string> names;
  for (const char* name : {"AcquisitionStart", "FrameBurstStart", "FrameStart"}) {
    names.emplace_back(name);
    if (name == frame_trigger) return names;
  }
  return {frame_trigger};
}

void add_acquisition(FeatureList& list, const GigeModel& model) {
  list.command("AcquisitionStart");
  list.command("AcquisitionStop");
  const std::size_t first = list.all.size();
  list.choice("AcquisitionMode", {"SingleFrame", "MultiFrame", "Continuous"}, 2);
  list.choice("ExposureMode", {"Timed", "TriggerWidth"});
  list.lock(first);
  list.flag("AcquisitionFrameRateEnable");
  list.add("AcquisitionFrameRate", Kind::real, 20, 1, 60);
  list.choice("ExposureAuto", {"Off", "Once", "Continuous"});
  list.add("ExposureTime", Kind::real, 10000, 10, 1'000'000);
  const auto triggers = triggers_of(model.frame_trigger);
  list.choice("TriggerSelector", triggers, static_cast<double>(triggers.size() - 1));
  const std::size_t selected = list.all.size();
  list.choice("TriggerMode", {"Off", "On"});
  list.choice("TriggerSource", {"Software", "Line0", "Line1"});
  list.choice("TriggerActivation", {"RisingEdge", "LevelHigh"});
  list.choice("TriggerOverlap", {"Off", "ReadOut"});
  list.lock(selected);
  list.add("TriggerDelay", Kind::real, 0, 0, 1'000'000);
  list.select(selected, "TriggerSelector");
  list.command("TriggerSoftware");
}

void add_analog(FeatureList& list) {
  list.choice("GainAuto", {"Off", "Once", "Continuous"});
  list.add("Gain", Kind::real, 0, 0, 24);
  list.add("BlackLevel", Kind::real, 0, 0, 64);
  list.choice("BalanceWhiteAuto", {"Off", "Once", "Continuous"});
  list.choice("BalanceRatioSelector", {"Red", "Green", "Blue"});
  list.add("BalanceRatio", Kind::real, 1, 0.25, 4).selector = "BalanceRatioSelector";
  list.flag("GammaEnable");
  list.add("Gamma", Kind::real, 1, 0.25, 4);
  list.flag("LUTEnable");
}

void add_lines(FeatureList& list, GigeOutputs outputs) {
  if (outputs == GigeOutputs::none) return;
  const bool user = outputs == GigeOutputs::user_output;
  list.choice("LineSelector", {"Line0", "Line1", "Line2"});
  const std::size_t selected = list.all.size();
  list.choice("LineMode", {"Input", "Output"});
  list.choice("LineSource", {user ? "UserOutput1" : "Off", "ExposureActive"});
  if (outputs == GigeOutputs::no_exposure_active) list.all.back().entries.pop_back();
  list.select(selected, "LineSelector");
  if (!user) return;
  list.choice("UserOutputSelector", {"UserOutput1"});
  list.flag("UserOutputValue").selector = "UserOutputSelector";
}

void add_services(FeatureList& list, const GigeModel& model) {
  if (model.has_user_sets) {
    list.choice("UserSetSelector", {"Default", "UserSet1"});
    list.command("UserSetLoad").is_locked = true;
  }
  if (model.ptp == GigeModel::Ptp::none) return;
  list.flag("PtpEnable").is_locked = true;
  list.command("PtpDataSetLatch");
  list.computed("PtpStatus").entries = numbered(
      {"Initializing", "Faulty", "Disabled", "Listening", "PreMaster", "Master", "Passive", "Uncalibrated", "Slave"});
  list.computed("PtpOffsetFromMaster");
}

std::string hex(std::uint32_t number) { return fmt::format("0x{:x}", number); }

std::string register_node(const GigeFeature& feature) {
  const bool real = feature.kind == Kind::real;
  const std::string index =
      feature.selector.empty() ? "" : fmt::format("<pIndex Offset=\"4\">{}Reg</pIndex>", feature.selector);
  return fmt::format(
      "<{0} Name=\"{1}Reg\"><Address>{2}</Address>{3}<Length>4</Length><AccessMode>{4}</AccessMode>"
      "<pPort>Device</pPort><Cachable>NoCache</Cachable>{5}<Endianess>BigEndian</Endianess></{0}>\n",
      real ? "FloatReg" : "IntReg", feature.name, hex(feature.address), index,
      feature.kind == Kind::computed ? "RO" : "RW", real ? "" : "<Sign>Signed</Sign>");
}

std::string limits(const GigeFeature& feature) {
  if (feature.kind == Kind::computed) return {};
  const std::string high = feature.limit.empty() ? fmt::format("<Max>{}</Max>", feature.high)
                                                 : fmt::format("<pMax>{}Reg</pMax>", feature.limit);
  return fmt::format("<Min>{}</Min>{}", feature.low, high);
}

std::string value_node(const GigeFeature& feature) {
  const std::string value = fmt::format("<pValue>{}Reg</pValue>", feature.name);
  const auto node = [&](std::string_view type, const std::string& content) {
    return fmt::format("<{0} Name=\"{1}\">{2}</{0}>\n", type, feature.name, content);
  };
  if (!feature.entries.empty()) {
    std::string entries;
    for (const auto& [name, number] : feature.entries) {
      entries += fmt::format("<EnumEntry Name=\"{}\"><Value>{}</Value></EnumEntry>", name, number);
    }
    return node("Enumeration", entries + value);
  }
  switch (feature.kind) {
    case Kind::real: return node("Float", value + limits(feature));
    case Kind::boolean: return node("Boolean", value + "<OnValue>1</OnValue><OffValue>0</OffValue>");
    case Kind::command: return node("Command", value + "<CommandValue>1</CommandValue>");
    default: return node("Integer", value + limits(feature));
  }
}

std::optional<GigeModel::Ptp> parse_ptp(std::string_view word) {
  using Ptp = GigeModel::Ptp;
  constexpr std::array<std::pair<std::string_view, Ptp>, 4> kPtp{
      {{"none", Ptp::none}, {"slave", Ptp::slave}, {"never", Ptp::never}, {"wide", Ptp::wide}}};
  const auto* found = std::ranges::find(kPtp, word, &std::pair<std::string_view, Ptp>::first);
  return found == kPtp.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

Result<void> change_gige_model(GigeModel& model, std::string_view word) {
  const auto equals = word.find('=');
  const std::string_view key = word.substr(0, equals);
  const std::string_view value = equals == std::string_view::npos ? "" : word.substr(equals + 1);
  if (key == "state") {
    std::uint64_t seed = 0;
    const auto [end, failed] = std::from_chars(value.data(), value.data() + value.size(), seed);
    if (failed == std::errc() && end == value.data() + value.size()) {
      model.state = seed;
      return {};
    }
  }
  if (key == "user-sets" && (value == "yes" || value == "no")) {
    model.has_user_sets = value == "yes";
    return {};
  }
  if (const auto ptp = parse_ptp(value); key == "ptp" && ptp) {
    model.ptp = *ptp;
    return {};
  }
  if ((key == "without" || key == "stuck") && !value.empty()) {
    (key == "stuck" ? model.stuck : model.without).emplace_back(value);
    return {};
  }
  return fail(ErrorCode::invalid_input, "GigE camera: {} is no property; see change_gige_model()", word);
}

std::vector<GigeFeature> gige_features(const GigeModel& model) {
  FeatureList list;
  add_format(list, model);
  add_acquisition(list, model);
  add_analog(list);
  add_lines(list, model.outputs);
  add_services(list, model);
  std::erase_if(list.all, [&](const GigeFeature& feature) {
    return std::ranges::find(model.without, feature.name) != model.without.end();
  });
  std::uint32_t address = kGigeFirstAddress;
  for (GigeFeature& feature : list.all) {
    feature.address = address;
    address += kGigeWords * 4;
  }
  return std::move(list.all);
}

std::string describe(const std::vector<GigeFeature>& features) {
  std::string names, nodes;
  for (const GigeFeature& feature : features) {
    names += fmt::format("<pFeature>{}</pFeature>", feature.name);
    nodes += value_node(feature) + register_node(feature);
  }
  // The delay between packets, ns: its register is one of GigE Vision's own.
  constexpr const char* kOwn =
      R"(<Integer Name="GevSCPD"><pValue>GevSCPDReg</pValue><Min>0</Min><Max>1000000000</Max></Integer>
<IntReg Name="GevSCPDReg"><Address>0xd08</Address><Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort>
<Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>
<Integer Name="TLParamsLocked"><Value>0</Value></Integer>
<Port Name="Device"></Port>
)";
  return fmt::format(
      R"(<?xml version="1.0" encoding="utf-8"?>
<RegisterDescription ModelName="Twin" VendorName="scanrig" ToolTip="simulated camera" StandardNameSpace="GEV"
 SchemaMajorVersion="1" SchemaMinorVersion="1" SchemaSubMinorVersion="0" MajorVersion="1" MinorVersion="0"
 SubMinorVersion="0" ProductGuid="00000000-0000-0000-0000-000000000000"
 VersionGuid="00000000-0000-0000-0000-000000000000" xmlns="http://www.genicam.org/GenApi/Version_1_1">
<Category Name="Root">{}</Category>
{}{}</RegisterDescription>
)",
      names, nodes, kOwn);
}

}  // namespace scanrig::sim::wire
