/* One tile: four sensors, a thousand times a second, as frames on the serial port; and, if there is one, an
   accelerometer four times as often. See README.md beside this file. */

#include "tile_frame.h"

const uint16_t TILE = 0;                         /* the tile's place in the floor's file, from 0 */
const uint8_t SENSORS[4] = {A0, A1, A2, A3};     /* in the order of the floor's file */
const uint32_t PERIOD_US = 1000;
const int ACCELEROMETER = -1;                    /* the pin of an analog accelerometer, -1 for none: binary frames alone */
const bool AS_TEXT = false;                      /* lines of text instead: for a first look, at 200 Hz at most */

/* Readings go out as 0 to 65535: a converter's bits stand at the top. */
#if defined(TEENSYDUINO) || defined(ARDUINO_ARCH_SAMD) || defined(ARDUINO_ARCH_ESP32) || defined(ARDUINO_ARCH_RP2040)
const uint8_t BITS = 12;
#else
const uint8_t BITS = 10;
#endif

static uint16_t sequence = 0, shaken_sequence = 0;
static uint32_t due, shaken_due;
static uint16_t shaken[4];
static uint8_t shaken_count = 0;

/* Read the accelerometer when that is due; send a frame of four. 32768 is taken for rest: half the converter's range. */
static void shake() {
    const uint32_t now = micros();
    if (ACCELEROMETER < 0 || (int32_t)(now - shaken_due) < 0) return;
    shaken_due += PERIOD_US / 4;
    if ((int32_t)(now - shaken_due) > 0) shaken_due = now + PERIOD_US / 4;
    shaken[shaken_count++] = (uint16_t)analogRead(ACCELEROMETER) << (16 - BITS);
    if (shaken_count < 4) return;
    uint8_t frame[TILE_FRAME_SIZE];
    Serial.write(frame, tile_frame_encode_acceleration(frame, TILE, shaken_sequence, now, shaken));
    shaken_sequence++;
    shaken_count = 0;
}

void setup() {
    Serial.begin(1000000);                       /* boards with USB of their own ignore this */
#if defined(TEENSYDUINO) || defined(ARDUINO_ARCH_SAMD) || defined(ARDUINO_ARCH_ESP32) || defined(ARDUINO_ARCH_RP2040)
    analogReadResolution(BITS);
#endif
#if defined(__AVR__)
    ADCSRA = (ADCSRA & 0xF8) | 0x05;             /* the converter at 500 kHz: 26 instead of 104 microseconds each */
#endif
    due = shaken_due = micros();
}

void loop() {
    shake();
    const uint32_t now = micros();
    if ((int32_t)(now - due) < 0) return;
    due += AS_TEXT ? 5 * PERIOD_US : PERIOD_US;
    if ((int32_t)(now - due) > 0) due = now + PERIOD_US;   /* held up: what was missed is not made up for */

    uint16_t readings[4];
    for (uint8_t i = 0; i < 4; i++) {
        readings[i] = (uint16_t)analogRead(SENSORS[i]) << (16 - BITS);
        shake();                                 /* which is due between any two of them */
    }

    if (AS_TEXT) {
        char line[TILE_LINE_SIZE];
        tile_line_encode(line, TILE, sequence, now, readings);
        Serial.print(line);
    } else {
        uint8_t frame[TILE_FRAME_SIZE];
        Serial.write(frame, tile_frame_encode(frame, TILE, sequence, now, readings));
    }
#if defined(TEENSYDUINO)
    Serial.send_now();                           /* else a packet waits some milliseconds to become full */
#endif
    sequence++;
}
