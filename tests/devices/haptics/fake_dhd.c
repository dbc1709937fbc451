/* A library with the functions of libdhd that are called: one device, its doings told
   by environment variables, what it was asked written to a table that tests read. */
#include <stdlib.h>
#include <string.h>

double told[8];   /* forces x y z, number of them, largest, enabled, closed, opened */
double place[3] = {0.01, -0.02, 0.03};
double frame[3][3] = {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}};
int gone, buttons;

static int is_set(const char *name) { return getenv(name) != NULL; }

int dhdOpen(void) { told[7]++; return is_set("FAKE_NONE") ? -1 : 3; }
int dhdClose(char id) { told[6]++; return id == 3 ? 0 : -1; }
const char *dhdErrorGetLastStr(void) { return "no device found"; }
const char *dhdGetSystemName(char id) { return id == 3 ? "sigma.7" : NULL; }
int dhdHasWrist(char id) { return id == 3 && !is_set("FAKE_WRISTLESS"); }
int dhdEnableForce(unsigned char on, char id) { told[5] = on; return id == 3 ? 0 : -1; }
double dhdGetMaxForce(char id) { return is_set("FAKE_LIMITLESS") ? -1.0 : 20.0; }
unsigned dhdGetButtonMask(char id) { return id == 3 ? (unsigned)buttons : 0; }
int dhdGetPositionAndOrientationFrame(double *x, double *y, double *z,
                                      double matrix[3][3], char id) {
    if (id != 3 || gone) return -1;
    *x = place[0]; *y = place[1]; *z = place[2];
    memcpy(matrix, frame, sizeof frame);
    return 0;
}
int dhdSetForce(double x, double y, double z, char id) {
    if (id != 3 || gone) return -1;
    told[0] = x; told[1] = y; told[2] = z; told[3]++;
    double size = x * x + y * y + z * z;
    if (size > told[4]) told[4] = size;
    return 2; /* a motor is saturated */
}
