#include "sim/scene/effects.h"

#include <gtest/gtest.h>

#include "sim/scene/materials.h"

namespace scanrig::sim {
namespace {

TEST(Workshop, IsFrozen) {
  // A change of any magnitude needs a new version; then this hash is replaced.
  const ChosenProfile workshop{.effects = choose_effects("workshop", "", "").value()};
  EXPECT_EQ(workshop.sha256(), "3fa09a0d86ea8afb0a4a42761868d4ae48e2d00392cdc9dab1ebe8dea37d5e7b");
}

TEST(Workshop, IsProfile1WithoutEffects) {
  EXPECT_EQ(ChosenProfile{}.sha256(), profile_sha256());
  EXPECT_TRUE(choose_effects("1", "", "")->is_none());
  EXPECT_TRUE(choose_effects("laboratory", "", "")->is_none());
  const auto none = choose_effects("2", "optics,sensor,projector,materials,turntable,drift,room", "");
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->is_none());
}

TEST(Workshop, HasEachSizeInOneEffect) {
  std::size_t sizes = 0;
  for (const Effect& effect : workshop_effects()) {
    for (const auto& size : effect.sizes) {
      EXPECT_NE(size.value, Effects{}.*size.member) << size.name;
      ++sizes;
    }
  }
  EXPECT_EQ(sizes * sizeof(double), sizeof(Effects));
}

TEST(Workshop, SwitchesEachEffectOffAlone) {
  const Effects all = choose_effects("workshop", "", "handling").value();
  for (const Effect& effect : workshop_effects()) {
    const auto without = choose_effects("workshop", effect.name, effect.family == "handling" ? "" : "handling");
    ASSERT_TRUE(without) << effect.name;
    for (const Effect& other : workshop_effects()) {
      for (const auto& size : other.sizes) {
        const bool is_off = other.name == effect.name || (effect.family == "handling" && other.family == "handling");
        EXPECT_EQ((*without).*size.member, is_off ? Effects{}.*size.member : all.*size.member)
            << effect.name << " " << size.name;
      }
    }
  }
}

TEST(Workshop, SparesTheObjectFromHandsThatNobodyAsksFor) {
  const Effects workshop = choose_effects("workshop", "", "").value();
  EXPECT_EQ(workshop.creep_mm, 0.0);
  EXPECT_EQ(workshop.sticker, 0.0);
  const Effects rocked = choose_effects("workshop", "gloss", "rock,finger").value();
  EXPECT_GT(rocked.rock_deg, 0.0);
  EXPECT_GT(rocked.finger, 0.0);
  EXPECT_EQ(rocked.creep_mm, 0.0);
  EXPECT_EQ(rocked.gloss, 0.0);
}

TEST(Workshop, RefusesNamesThatDoNotExist) {
  const auto profile = choose_effects("garage", "", "");
  EXPECT_EQ(profile.error().code, ErrorCode::not_found);
  EXPECT_NE(profile.error().message.find("workshop (2)"), std::string::npos);
  const auto effect = choose_effects("workshop", "gloss,wobbel", "");
  EXPECT_EQ(effect.error().code, ErrorCode::not_found);
  EXPECT_NE(effect.error().message.find("wobbel"), std::string::npos);
  EXPECT_NE(effect.error().message.find(" wobble "), std::string::npos);
  EXPECT_EQ(choose_effects("workshop", "", "drop").error().code, ErrorCode::not_found);
  EXPECT_EQ(choose_effects("laboratory", "gloss", "").error().code, ErrorCode::invalid_input);
  const auto material = Materials::named("satin+velvet", {});
  EXPECT_EQ(material.error().code, ErrorCode::not_found);
  EXPECT_NE(material.error().message.find("velvet"), std::string::npos);
  EXPECT_EQ(Materials::named("", {}).error().code, ErrorCode::not_found);
}

TEST(Workshop, HasAnotherHashForEachChoice) {
  const ChosenProfile workshop{.effects = choose_effects("2", "", "").value()};
  ChosenProfile other = workshop;
  other.effects.runout_mm = 0.0;
  EXPECT_NE(other.sha256(), workshop.sha256());
  other = workshop;
  other.material = "gloss";
  EXPECT_NE(other.sha256(), workshop.sha256());
  other = workshop;
  other.coding.gamma = 0.45;
  EXPECT_NE(other.sha256(), workshop.sha256());
  other = workshop;
  other.material = "satin";  // what it has anyway
  EXPECT_EQ(other.sha256(), workshop.sha256());
}

}  // namespace
}  // namespace scanrig::sim
