/* An attacker does not run our DDS library but a patched one. Preloaded into a probe, this makes every check
 * of signatures, chains and dates succeed in that process, so that only its peers are left to refuse it.
 * The prototypes are OpenSSL's (openssl/pkcs7.h, openssl/x509_vfy.h), written out to need no headers. */
#define _GNU_SOURCE
#include <dlfcn.h>

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
