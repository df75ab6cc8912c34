"""Certificates: an authority of one's own, and what it issues. X.509, ECDSA on P-256, PEM.

The common name is the name in the policy, the organizational unit the role. Only the router's certificate may serve,
so that the holder of another one cannot pretend to be the router.
"""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime, timedelta
from ipaddress import ip_address

from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from skillwing.services.access.certificate_facts import CertificateFacts, Issued
from skillwing.services.errors import SkillwingError

LONGEST_NAME = 64
"""Characters of a common name, by X.520."""
CLOCK_SKEW = timedelta(hours=1)
"""Time by which the clock of another machine may be behind."""
AUTHORITY_NAME = "Skillwing authority"


def new_authority(days: int, now: datetime) -> Issued:
    """An authority that signs its own certificate."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = _name(AUTHORITY_NAME, "")
    builder = _builder(name, name, key.public_key(), days, now)
    builder = builder.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
    builder = builder.add_extension(_key_usage(signs=True), critical=True)
    return Issued(_pem(builder.sign(key, hashes.SHA256())), _key_pem(key))


def issue(authority: Issued, name: str, role: str, days: int, now: datetime, hosts: Iterable[str] = ()) -> Issued:
    """A certificate for a name. hosts: addresses at which its holder serves; none for a client.

    Raises SkillwingError for a name that is too long.
    """
    if len(name) > LONGEST_NAME:
        raise SkillwingError(f"The name `{name}` has more than {LONGEST_NAME} characters. Choose a shorter one.")
    parent = x509.load_pem_x509_certificate(authority.certificate)
    signer = _private_key(authority.key)
    key = ec.generate_private_key(ec.SECP256R1())
    builder = _builder(_name(name, role), parent.subject, key.public_key(), days, now)
    builder = builder.add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
    builder = builder.add_extension(_key_usage(signs=False), critical=True)
    use = ExtendedKeyUsageOID.SERVER_AUTH if hosts else ExtendedKeyUsageOID.CLIENT_AUTH
    builder = builder.add_extension(x509.ExtendedKeyUsage([use]), critical=False)
    if hosts:
        builder = builder.add_extension(x509.SubjectAlternativeName([_host(host) for host in hosts]), critical=False)
    return Issued(_pem(builder.sign(signer, hashes.SHA256())), _key_pem(key))


def facts(certificate: bytes) -> CertificateFacts:
    """The content of a certificate in PEM. Raises ValueError for anything else."""
    read = x509.load_pem_x509_certificate(certificate)
    hosts: tuple[str, ...] = ()
    try:
        names = read.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        hosts = tuple(str(each.value) for each in names)
    except x509.ExtensionNotFound:
        pass
    name, role = (_attribute(read, oid) for oid in (NameOID.COMMON_NAME, NameOID.ORGANIZATIONAL_UNIT_NAME))
    return CertificateFacts(name, role, read.not_valid_after_utc, hosts)


def fits(certificate: bytes, key: bytes) -> bool:
    """True if a key, in PEM format as the certificate, is the one of the certificate.

    Raises ValueError for a file that is damaged, or a key with a password.
    """
    try:
        public = x509.load_pem_x509_certificate(certificate).public_key()
        return public == load_pem_private_key(key, None).public_key()
    except (TypeError, UnsupportedAlgorithm) as error:
        raise ValueError(str(error)) from error


def _attribute(certificate: x509.Certificate, oid: x509.ObjectIdentifier) -> str:
    return next((str(each.value) for each in certificate.subject.get_attributes_for_oid(oid)), "")


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePublicKey, days: int, now: datetime
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - CLOCK_SKEW)
        .not_valid_after(now + timedelta(days=days))
    )


def _name(name: str, role: str) -> x509.Name:
    attributes = [x509.NameAttribute(NameOID.COMMON_NAME, name)]
    attributes += [x509.NameAttribute(NameOID.ORGANIZATIONAL_UNIT_NAME, role)] if role else []
    return x509.Name(attributes)


def _host(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _key_usage(*, signs: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs,
        crl_sign=signs,
        encipher_only=False,
        decipher_only=False,
    )


def _private_key(pem: bytes) -> ec.EllipticCurvePrivateKey:
    key = load_pem_private_key(pem, None)
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise SkillwingError(
            "The authority's key is no key of Skillwing. Make a new folder with `skillwing keys init`."
        )
    return key


def _pem(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(Encoding.PEM)


def _key_pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
