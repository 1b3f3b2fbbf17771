#!/bin/sh
# Passwords of everybody in router.toml, and a certificate for the router, new each time. Needs openssl.
#   deploy/nodes/secrets.sh [FOLDER] [NAME OF THE ROUTER...]
set -eu
umask 077
here=$(dirname "$0")
folder=${1:-$here/secrets}
[ $# -gt 0 ] && shift
names=${*:-router localhost}
mkdir -p "$folder"
cd "$folder"
: > users.txt
for user in hall_a_edge hall_a_server hall_b_edge hall_b_server hall_c_edge hall_c_server operator; do
    password=$(openssl rand -hex 24)
    echo "$user:$password" >> users.txt
    echo "$user:$password" > "$user.txt"
done
alternatives=
for name in $names; do alternatives="${alternatives:+$alternatives,}DNS:$name"; done
openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 3650 -subj "/CN=Umbracast" \
    -keyout ca.key -out ca.pem 2>/dev/null
openssl req -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -subj "/CN=router" -keyout router.key -out router.csr 2>/dev/null
printf 'subjectAltName=%s\nbasicConstraints=CA:FALSE\n' "$alternatives" > router.ext
openssl x509 -req -in router.csr -CA ca.pem -CAkey ca.key -CAcreateserial -days 825 -extfile router.ext -out router.pem 2>/dev/null
rm -f router.csr router.ext ca.srl
# All of it is for its owner alone, also what an earlier run left. Containers of Compose run as the owner, those of Kubernetes get
# copies that their group may read.
chmod 600 ./*
