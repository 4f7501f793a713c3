#include "drivers/projector/lightcrafter_packets.h"

#include <gmock/gmock.h>

namespace scanrig::dlpc350 {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::uint8_t> head(const std::vector<Report>& reports, std::size_t count) {
  return {reports.front().begin(), reports.front().begin() + static_cast<std::ptrdiff_t>(count)};
}

Report reply(std::uint8_t flags, std::uint8_t sequence, std::uint16_t length, std::uint8_t fill = 0) {
  Report report{};
  report.fill(fill);
  report[0] = flags;
  report[1] = sequence;
  report[2] = static_cast<std::uint8_t>(length);
  report[3] = static_cast<std::uint8_t>(length >> 8);
  return report;
}

// The frame that starts a sequence, 00 40 ss 03 00 24 1A 02, without the report number in front [DLPU010, 1.2.2].
TEST(LightCrafterPackets, StartOfASequence) {
  const std::uint8_t start = 2;
  const auto reports = encode(Command::start_stop, Kind::write, 0x5C, {&start, 1});
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_THAT(head(reports, 7), ElementsAre(0x40, 0x5C, 0x03, 0x00, 0x24, 0x1A, 0x02));
  EXPECT_TRUE(std::all_of(reports[0].begin() + 7, reports[0].end(), [](auto byte) { return byte == 0; }));
}

TEST(LightCrafterPackets, ReadOfTheMainStatus) {
  const auto reports = encode(Command::main_status, Kind::read, 1, {});
  EXPECT_THAT(head(reports, 6), ElementsAre(0xC0, 0x01, 0x02, 0x00, 0x0C, 0x1A));
}

// The first report carries 60 bytes of payload (2 of them the command), the others 64 and no header.
TEST(LightCrafterPackets, LongWritesGoOnWithoutAHeader) {
  std::vector<std::uint8_t> data(58 + 64 + 1);
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint8_t>(i + 1);
  EXPECT_EQ(encode(Command::mailbox_data, Kind::write, 0, std::span(data).first(58)).size(), 1u);
  const auto reports = encode(Command::mailbox_data, Kind::write, 0, data);
  ASSERT_EQ(reports.size(), 3u);
  EXPECT_EQ(reports[0][2], 125);
  EXPECT_EQ(reports[0][63], 58);
  EXPECT_EQ(reports[1][0], 59);
  EXPECT_EQ(reports[2][0], 123);
  EXPECT_EQ(reports[2][1], 0);
}

TEST(LightCrafterPackets, AReplyOfOneReport) {
  ReplyReader reader(9);
  auto report = reply(0, 9, 2);
  report[4] = 0x41;
  report[5] = 0x42;
  const auto whole = reader.add(report);
  ASSERT_TRUE(whole && *whole);
  EXPECT_THAT(reader.payload(), ElementsAre(0x41, 0x42));
}

TEST(LightCrafterPackets, ALongReplyIsPutTogether) {
  ReplyReader reader(9);
  const auto first = reader.add(reply(0, 9, 130, 1));
  ASSERT_TRUE(first);
  EXPECT_FALSE(*first);
  EXPECT_FALSE(*reader.add(reply(2, 2, 2, 2)));  // what looks like a header is payload
  EXPECT_TRUE(*reader.add(reply(3, 3, 3, 3)));
  EXPECT_EQ(reader.payload().size(), 130u);
  EXPECT_EQ(reader.payload()[60], 2);
}

TEST(LightCrafterPackets, AnEmptyReplyIsWhole) {
  ReplyReader reader(9);
  EXPECT_TRUE(*reader.add(reply(0, 9, 0)));
}

TEST(LightCrafterPackets, WhatIsNoReplyIsAProtocolError) {
  ReplyReader reader(9);
  const auto earlier = reader.add(reply(0, 8, 1));
  ASSERT_FALSE(earlier);
  EXPECT_EQ(earlier.error().code, ErrorCode::protocol);
  EXPECT_TRUE(reader.was_earlier());
  const auto refused = reader.add(reply(0x20, 9, 0));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("refuses"));
  EXPECT_FALSE(reader.was_earlier());
  EXPECT_EQ(reader.add(reply(0, 9, 513)).error().code, ErrorCode::protocol);
}

// Bits of a table entry [DLPU010, table 2-66]: trigger 1:0, pattern 7:2, depth 11:8, LEDs 14:12, invert 16, black 17,
// buffer swap 18.
TEST(LightCrafterPackets, ATableEntryIsThreeBytes) {
  EXPECT_THAT(encode(LutEntry{}), ElementsAre(0x00, 0x71, 0x00));
  LutEntry entry;
  entry.trigger = LutEntry::Trigger::falling;
  entry.pattern = 23;
  entry.depth = 8;
  entry.leds = 2;
  entry.invert = entry.black_after = entry.swap_buffer = true;
  EXPECT_THAT(encode(entry), ElementsAre(23 << 2 | 2, 0x28, 0x07));
}

TEST(LightCrafterPackets, StatusInWords) {
  EXPECT_EQ(hardware_faults(0x01), "");
  EXPECT_THAT(hardware_faults(0x00), HasSubstr("start-up"));
  EXPECT_EQ(hardware_faults(0x81), "the sequencer found an error");
  EXPECT_EQ(system_faults(0x01), "");
  EXPECT_THAT(system_faults(0x00), HasSubstr("memory"));
  EXPECT_EQ(validation_faults(0x0C), "");
  EXPECT_EQ(validation_faults(0x03), "exposure or period out of range, no such pattern");
  EXPECT_TRUE(runs(0x02));
  EXPECT_FALSE(runs(0x0D));
  EXPECT_TRUE(validating(0x80));
}

}  // namespace
}  // namespace scanrig::dlpc350
