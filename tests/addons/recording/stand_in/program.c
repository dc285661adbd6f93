/* A program on the stand-in: its script is the file beside it with ".asks" behind its name. */
#include <stdio.h>

int stand_in_run(int argc, char ** argv, const char * script);

int main(int argc, char ** argv)
{
  char script[4096];
  snprintf(script, sizeof script, "%s.asks", argv[0]);
  return stand_in_run(argc, argv, script);
}
