/* An ADS1015 or ADS1115 on a two-wire bus, as far as single conversions at the highest rate and +-4.096 V need it:
   registers, pointer, and the time that a conversion takes (datasheets SBAS473 and SBAS444 of Texas Instruments). */
#ifndef ADS1X15_H
#define ADS1X15_H

#include <math.h>
#include <stdint.h>

typedef struct {
  int selected, bytes, busy;
  uint8_t pointer;
  uint16_t config, result;
  double began; /* of the conversion under way [s] */
} Ads;

static double ads_time(int kind) { return 25e-6 + 1.0 / (kind == 1115 ? 860.0 : 3300.0); } /* wake-up and conversion */
static int ads_input(const Ads *chip) { return chip->config >> 12 & 3; }

static void ads_select(Ads *chip, int selected) {
  chip->selected = selected;
  chip->bytes = 0;
}

/* Take a byte; return whether a conversion begins with it. */
static int ads_write(Ads *chip, uint8_t byte) {
  switch (chip->bytes++) {
    case 0: chip->pointer = byte & 3; return 0;
    case 1: if (chip->pointer == 1) chip->config = (uint16_t)(byte << 8 | (chip->config & 0xFF)); return 0;
    case 2: if (chip->pointer == 1) chip->config = (uint16_t)((chip->config & 0xFF00) | byte); break;
    default: return 0;
  }
  if (chip->pointer != 1 || !(chip->config & 0x8000) || chip->busy) return 0;
  chip->busy = 1;
  return 1;
}

static void ads_finish(Ads *chip, int kind, double volts) {
  const double count = floor(volts / 4.096 * 32768.0);
  const int16_t value = (int16_t)(count < -32768.0 ? -32768.0 : count > 32767.0 ? 32767.0 : count);
  chip->busy = 0;
  chip->result = (uint16_t)(kind == 1115 ? value : value & ~0xF); /* 12 bits, left-justified */
}

static uint8_t ads_read(Ads *chip) {
  const uint16_t config = (uint16_t)((chip->config & 0x7FFF) | (chip->busy ? 0 : 0x8000));
  const uint16_t word = chip->pointer == 0 ? chip->result : chip->pointer == 1 ? config : 0;
  return (uint8_t)(chip->bytes++ ? word & 0xFF : word >> 8);
}

#endif
