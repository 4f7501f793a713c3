#include <gmock/gmock.h>

#include "config/drive_profile_file.h"
#include "drivers/turntable/modbus_drive.h"
#include "sim/wire/modbus_frame.h"
#include "tests/unit/drivers/scripted_peer.h"

// Frames as printed in the Leadshine RS manuals and docs; the peer compares bytes and replies with bytes.

namespace scanrig {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;

class GoldenFrames : public testing::Test {
 protected:
  RealClock clock_;

  Deadline soon() { return Deadline::after(clock_, milliseconds(2000)); }
  static DriveProfile profile(const std::string& name) {
    auto profile = config::read_drive_profile(SCANRIG_SOURCE_DIR "/config/drives/" + name + ".toml");
    EXPECT_TRUE(profile) << profile.error().message;
    return *profile;
  }
  ModbusDrive drive_on(const ScriptedPeer& peer, const DriveProfile& profile, int unit_id = 1) {
    modbus::ClientOptions options;
    options.device = peer.device();
    options.unit_id = unit_id;
    return {options, profile, clock_};
  }
  ModbusDrive drive_on(const ScriptedPeer& peer, int unit_id) {
    return drive_on(peer, profile("leadshine-rs"), unit_id);
  }
  void expect_sent(const std::string& request, const std::string& answer,
                   const std::function<Result<void>(ModbusDrive&)>& act, int unit_id = 1) {
    ScriptedPeer peer(ScriptedPeer::Answers{{request, answer}});
    auto drive = drive_on(peer, unit_id);
    const auto done = act(drive);
    EXPECT_TRUE(done) << done.error().message;
    EXPECT_THAT(peer.heard(), ElementsAre(request));
  }
};

TEST_F(GoldenFrames, AnAbsoluteMoveIsOneBlock) {
  expect_sent(
      "07 10 62 00 00 08 10 00 01 00 00 27 10 00 00 27 10 27 10 00 00 00 10 8D 50", "07 10 62 00 00 08 DE 11",
      [&](ModbusDrive& drive) {
        return drive.start_move(10000, {0, 10000, 10000, 0}, soon());
      },
      7);
}

TEST_F(GoldenFrames, QuickStop) {
  expect_sent("01 06 60 02 00 40 37 FA", "01 06 60 02 00 40 37 FA",
              [&](ModbusDrive& drive) { return drive.stop(soon()); });
}

TEST_F(GoldenFrames, Home) {
  expect_sent("01 06 60 02 00 20 37 D2", "01 06 60 02 00 20 37 D2",
              [&](ModbusDrive& drive) { return drive.start_homing(soon()); });
}

TEST_F(GoldenFrames, AlarmReset) {
  expect_sent("01 06 18 01 11 11 12 F6", "01 06 18 01 11 11 12 F6",
              [&](ModbusDrive& drive) { return drive.reset_alarm(soon()); });
}

// The replies' checksums were computed with another program.
TEST_F(GoldenFrames, StatusAndANegativePosition) {
  ScriptedPeer peer(
      {{"01 03 10 03 00 01 70 CA", "01 03 02 00 72 38 61"}, {"01 03 60 2C 00 02 1B C2", "01 03 04 FF FE 79 60 88 6F"}});
  auto drive = drive_on(peer, 1);
  const auto state = drive.read_state(soon());
  ASSERT_TRUE(state) << state.error().message;
  EXPECT_EQ(state->position, -100000);
  EXPECT_FALSE(state->fault);
  EXPECT_TRUE(state->enabled);
  EXPECT_FALSE(state->running);
  EXPECT_TRUE(state->in_position);
  EXPECT_TRUE(state->homed);
  EXPECT_THAT(peer.heard(), ElementsAre("01 03 10 03 00 01 70 CA", "01 03 60 2C 00 02 1B C2"));
}

// The manuals' example of a request the drive saw damaged: it is sent again.
TEST_F(GoldenFrames, ARequestTheDriveSawDamagedIsRepeated) {
  ScriptedPeer peer(ScriptedPeer::Answers{{"01 03 00 01 00 01 D5 CA", "01 83 08 40 F6"}});
  auto drive = drive_on(peer, 1);
  const auto pulses = drive.read_pulses_per_motor_rev(soon());
  ASSERT_FALSE(pulses);
  EXPECT_EQ(pulses.error().code, ErrorCode::protocol);
  EXPECT_EQ(peer.heard().size(), 3u);
  EXPECT_EQ(drive.statistics().retries, 2u);
}

// Oriental Motor AZ. 8E1 on the wire; a pseudo-terminal refuses parity, so these bytes are proven with 8N1.
class OrientalFrames : public GoldenFrames {
 protected:
  const std::string release_ = "01 06 00 7D 00 00 19 D2";

  /// The input is reset before, since an earlier program may have been killed, and after.
  void expect_pulled(const std::string& request, const std::function<Result<void>(ModbusDrive&)>& act) {
    ScriptedPeer peer(ScriptedPeer::Answers{{request, request}, {release_, release_}});
    auto drive = drive_on(peer, profile("oriental-az"));
    const auto done = act(drive);
    EXPECT_TRUE(done) << done.error().message;
    EXPECT_THAT(peer.heard(), ElementsAre(release_, request, release_));
  }
};

TEST_F(OrientalFrames, DirectDataOperation) {
  auto relative = profile("oriental-az");
  relative.move.words[3].value = 2;  // the manual's example is relative to the command position
  const std::string request =
      "01 10 00 58 00 10 20 00 00 00 00 00 00 00 02 00 00 21 34 00 00 07 D0 00 00 05 DC 00 00 05 DC 00 00 03 E8 "
      "00 00 00 01 1C 08";
  ScriptedPeer peer(ScriptedPeer::Answers{{request, "01 10 00 58 00 10 40 16"}, {release_, release_}});
  auto drive = drive_on(peer, relative);
  const auto moved = drive.start_move(8500, {2000, 1500, 1500, 0}, soon());
  EXPECT_TRUE(moved) << moved.error().message;
  EXPECT_THAT(peer.heard(), ElementsAre(release_, request));
}

TEST_F(OrientalFrames, HomeIsPulledAndLetGo) {
  expect_pulled("01 06 00 7D 00 10 18 1E", [&](ModbusDrive& drive) { return drive.start_homing(soon()); });
}

TEST_F(OrientalFrames, StopComesFirstAndIsLetGo) {
  const std::string stop = "01 06 00 7D 00 20 18 0A";
  ScriptedPeer peer(ScriptedPeer::Answers{{stop, stop}, {release_, release_}});
  auto drive = drive_on(peer, profile("oriental-az"));
  EXPECT_TRUE(drive.stop(soon()));
  EXPECT_THAT(peer.heard(), ElementsAre(stop, release_));
}

// MOVE, HOME-END and INFO; the replies' checksums were computed with another program.
TEST_F(OrientalFrames, StatusAndANegativePosition) {
  ScriptedPeer peer(
      {{"01 03 00 7F 00 01 B5 D2", "01 03 02 20 50 A1 B8"}, {"01 03 00 CC 00 02 04 34", "01 03 04 FF FE 79 60 88 6F"}});
  auto drive = drive_on(peer, profile("oriental-az"));
  const auto state = drive.read_state(soon());
  ASSERT_TRUE(state) << state.error().message;
  EXPECT_EQ(state->position, -100000);
  EXPECT_TRUE(state->running);
  EXPECT_TRUE(state->homed);
  EXPECT_FALSE(state->in_position);
  EXPECT_FALSE(state->fault);
  EXPECT_EQ(peer.heard().front(), "01 03 00 7F 00 01 B5 D2");
}

// CRC-16/MODBUS of "123456789" is 0x4B37 [catalogue of parametrised CRC algorithms].
TEST(FarEndOfTheWire, ChecksumHasThePublishedCheckValue) {
  const sim::wire::Bytes digits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(sim::wire::modbus_crc(digits), 0x4B37);
}

}  // namespace
}  // namespace scanrig
