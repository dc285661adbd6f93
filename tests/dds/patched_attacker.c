/* An attacker does not run our DDS library but a patched one. Preloaded into a probe, this makes every check
 * of signatures, chains and dates succeed in that process, so that only its peers are left to refuse it.
 * It also takes the subject $PATCHED_SUBJECT, its own, for $PATCHED_CLAIM.
 * The prototypes are OpenSSL's (openssl/pkcs7.h, openssl/x509_vfy.h), written out to need no headers. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

enum { PKCS7_NOSIGS = 0x4, PKCS7_NOVERIFY = 0x20 };

typedef int (*pkcs7_verify)(void *p7, void *certs, void *store, void *in, void *out, int flags);

int PKCS7_verify(void *p7, void *certs, void *store, void *in, void *out, int flags) {
  pkcs7_verify real = (pkcs7_verify)dlsym(RTLD_NEXT, "PKCS7_verify");
  return real(p7, certs, store, in, out, flags | PKCS7_NOSIGS | PKCS7_NOVERIFY);
}

int X509_verify_cert(void *context) {
  (void)context;
  return 1;
}

typedef int (*x509_name_print_ex)(void *out, const void *name, int indent, unsigned long flags);
void *BIO_s_mem(void);
void *BIO_new(const void *type);
int BIO_read(void *bio, void *data, int length);
int BIO_write(void *bio, const void *data, int length);
int BIO_free(void *bio);

static const char *variable(const char *name) {
  const char *value = getenv(name);
  return value != NULL ? value : "";
}

int X509_NAME_print_ex(void *out, const void *name, int indent, unsigned long flags) {
  x509_name_print_ex real = (x509_name_print_ex)dlsym(RTLD_NEXT, "X509_NAME_print_ex");
  char text[512] = "";
  void *scratch = BIO_new(BIO_s_mem());
  real(scratch, name, indent, flags);
  BIO_read(scratch, text, sizeof text - 1);
  BIO_free(scratch);
  if (strcmp(text, variable("PATCHED_SUBJECT")) != 0) return real(out, name, indent, flags);
  const char *claim = variable("PATCHED_CLAIM");
  return BIO_write(out, claim, (int)strlen(claim));
}
