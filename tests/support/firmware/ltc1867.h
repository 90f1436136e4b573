/* An LTC1867 on SPI, as far as single-ended conversions from 0 V need it: a word in, the conversion before it out, a
   conversion as CS/CONV rises (data sheet of the LTC1863 and LTC1867, rev. E; the words as in the maker's own library). */
#ifndef LTC1867_H
#define LTC1867_H

#include <stdint.h>

typedef struct {
  int low, bytes; /* CS/CONV, and bytes since it fell */
  uint8_t command;
  uint16_t result, shifted;
  double began; /* of the newest conversion [s] */
} Ltc;

static const double LTC_TIME = 3.5e-6; /* s that a conversion takes at most */

static int ltc_input(const Ltc *chip) { return (chip->command >> 4 & 3) * 2 + (chip->command >> 6 & 1); }

static void ltc_fall(Ltc *chip, double now) {
  const int early = now - chip->began < LTC_TIME; /* then it says nonsense and takes no word: the worst that could be */
  chip->low = 1, chip->bytes = 2 * early;
  chip->shifted = early ? 0xAAAA : chip->result;
}

/* Take a byte, and return the one that comes out meanwhile. */
static uint8_t ltc_byte(Ltc *chip, uint8_t byte) {
  if (!chip->low) return 0xFF;
  if (chip->bytes++ == 0) chip->command = byte;
  return (uint8_t)(chip->bytes == 1 ? chip->shifted >> 8 : chip->shifted & 0xFF);
}

static void ltc_rise(Ltc *chip, double now, double volts) {
  const double count = volts / 4.096 * 65536.0;
  const int wanted = (chip->command & 0x8C) == 0x84; /* against ground, not the common input, and unipolar */
  chip->low = 0, chip->began = now;
  chip->result = (uint16_t)(!wanted ? 0xAAAA : count < 0.0 ? 0.0 : count > 65535.0 ? 65535.0 : count);
}

#endif
